"""Reads curves from files: Elocute's own, and those of other programs, as ARKit's curves.

    .csv   Live Link Face's recordings (ours are like them), Audio2Face's, any table with a column
           for each curve
    .json  ours; Audio2Face's (`facsNames`, `weightMat`); Azure's visemes (`BlendShapes` of 55);
           lists of frames as numbers, as weights by name, or as MediaPipe's categories; one frame
           a line (.jsonl)
    .npy   (frame, 52) or (frame, 51, 55, 61), in ARKit's order

What a name says beside upper and lower case, `_L` and what stands before a dot is not looked at.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from elocute.array_types import Float32Array, Float64Array, FloatArray
from elocute.errors import MotionError
from elocute.export.arkit_csv import COLUMNS, POSE_COLUMNS, SIXTIETHS
from elocute.export.curves_json import are_texts, curves_of_record, rotations_of_record
from elocute.files.array_reading import read_npy
from elocute.files.json_records import finite_number, parse_json
from elocute.files.reading import FileKind, open_regular, read_text
from elocute.head.model import HeadModel
from elocute.head.viseme_shapes import VISEME_SHAPES
from elocute.motion.curves import ARKIT_NAMES, Curves
from elocute.motion.motion import FPS_MAX
from elocute.numerics.quaternions import from_axis_angle

SUFFIXES = (".csv", ".json", ".jsonl", ".npy")
ALLOWED = "curves: Live Link Face .csv, ARKit weights, Audio2Face or Azure .json, our own"
CURVES_FILE = FileKind(ALLOWED, 200_000_000, MotionError)
FRAMES_MAX = 5_000_000
VALUE_MAX = 1e6
OURS = "elocute"
"""What the formats of our own files begin with."""
ASSUMED_FPS = 60.0
RATES = (24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 90.0, 100.0, 120.0)
PAUSE = 1.5
"""Frames apart from which on times are not regular."""
NEARLY = 0.2
"""A rate that is named and no further from that of the times is theirs; others play it faster."""
REPEATED = 0.1
"""Of the frames of a clock that stands now and then; one that stands more often is none."""
PERCENT, PERCENT_SHARE = 3.0, 0.3
"""Weights are hundredths where those beyond add up to that share of the others: one that is too
high makes no hundredths of a take."""
WEIGHT_MAX = 1.05
"""Above one, and beyond what rounding and programs that overshoot a little leave."""
AZURE = (*ARKIT_NAMES, "headRoll", "leftEyeRoll", "rightEyeRoll")
WIDTHS = {
    51: ARKIT_NAMES[:51],
    52: ARKIT_NAMES,
    55: AZURE,
    61: (*COLUMNS, *(name[0].lower() + name[1:] for name in POSE_COLUMNS)),
}
"""What the columns of a table without names are."""
ALLOWED_WIDTHS = "51, 52, 55 or 61"
OWN = tuple(dict.fromkeys(name for look in VISEME_SHAPES.values() for name in look))
_FRAMES = ("frames", "weightMat", "BlendShapes", "blendShapes", "blendshapes", "weights", "values")
_FRAMES += ("data", "animation")
_NAMES = ("facsNames", "names", "blendShapeNames", "blendshapeNames", "blendshape_names")
_NAMES += ("blendShapes", "blendshapes", "shapes", "keys", "curves")
_RATES = ("fps", "exportFps", "frameRate", "framerate", "frame_rate")
_TIMES = ("timecode", "time", "timestamp", "t", "timesec", "times", "seconds", "timems")
_TIMES += ("timestampms",)
_ASIDE = ("blendshapecount", "frame", "frameindex", "index", "neutral", "expression", "rotation")
_SCORED = ("score", "value", "weight")


@dataclass(frozen=True, eq=False)
class CurveFile:
    """Curves as a file holds them.

    Attributes
    ----------
    curves : Curves
        On ARKit's names, or on the built-in head's.
    turns : (frame, 3) float64 or None
        How far the head is turned in half turns: yaw, pitch, roll.
    record : dict or None
        What our own .json holds, which has the turns of joints.
    notes : tuple of str
        What was assumed, and what was left out.
    """

    curves: Curves
    turns: Float64Array | None = None
    record: dict[str, Any] | None = None
    notes: tuple[str, ...] = ()

    def rotations(self, head: HeadModel) -> Float32Array | None:
        """(frame, joint, 4) wxyz of a head's joints; None where nothing turns. Raises MotionError.

        Neck and head each take half of a turn.
        """
        if self.record is not None:
            return rotations_of_record("curves", self.record, head.joint_names)
        if self.turns is None or not self.turns.any():
            return None
        names = [name for name in ("neck", "head") if name in head.joint_names]
        angles = self.turns[:, [1, 0, 2]] * np.pi / max(len(names), 1)
        return joint_turns(head, len(angles), dict.fromkeys(names, from_axis_angle(angles)))


def joint_turns(head: HeadModel, frames: int, turns: Mapping[str, FloatArray]) -> Float32Array:
    """(frame, joint, 4) wxyz of a head's joints from turns (frame, 4) by name; others rest."""
    turned = np.zeros((frames, len(head.joint_names), 4), np.float32)
    turned[..., 0] = 1
    for place, name in enumerate(head.joint_names):
        if name in turns:
            turned[:, place] = turns[name]
    return turned


@dataclass(frozen=True, eq=False)
class _Table:
    """Rows of numbers, and what they are."""

    names: Sequence[str]
    rows: Float64Array
    times_s: Float64Array | None = None
    fps: float | None = None
    notes: tuple[str, ...] = ()


def read_curves(path: str | Path, fps: float | None = None) -> CurveFile:
    """Read curves in any of the forms that are known.

    Parameters
    ----------
    path : str or Path
        A .csv, .json, .jsonl or .npy.
    fps : float, optional
        Frames per second, for a file that does not say it.

    Returns
    -------
    CurveFile

    Raises
    ------
    MotionError
        For a file that is missing or holds no curves that are known, naming the row or frame.
    """
    path = Path(path)
    if fps is not None and not 0 < fps <= FPS_MAX:
        raise MotionError.about(
            "frame rate", found=f"{fps:g}", allowed=f"above 0, up to {FPS_MAX:g}"
        )
    suffix = path.suffix.lower()
    if suffix == ".csv":
        table = _csv_table(path)
    elif suffix == ".npy":
        table = _npy_table(path)
    else:
        text = read_text(path, CURVES_FILE)
        record = _parsed(path, text)
        if isinstance(record, dict) and str(record.get("format")).startswith(OURS):
            return CurveFile(curves_of_record(path, record), record=record)
        table = _json_table(path, record)
    return _curves(path, table, fps)


def _curves(path: Path, table: _Table, fps: float | None) -> CurveFile:
    rows, rate, notes = _regular(path, table, fps)
    keys = [_key(name) for name in table.names]
    places = {_key(name): name for name in (*ARKIT_NAMES, *OWN)}
    known = [places[key] for key in keys if key in places]
    if not known:
        found = f"no curve that is known ({', '.join(map(str, table.names))[:120]})"
        raise MotionError.about(path, found=found, allowed=ALLOWED)
    if len(set(known)) != len(known):
        raise MotionError.about(path, found="a curve twice", allowed="each once")
    turns = [keys.index(_key(each)) if _key(each) in keys else -1 for each in POSE_COLUMNS[:3]]
    aside = {*map(_key, POSE_COLUMNS), *map(_key, AZURE[52:]), *_TIMES, *_ASIDE}
    unknown = [n for n, key in zip(table.names, keys, strict=True) if key not in {*places, *aside}]
    if unknown:
        told = ", ".join(unknown[:6]) + (", …" if len(unknown) > 6 else "")
        notes.append(f"{path.name}: left out {told}: no curves of the head")
    values = rows[:, [place for place, key in enumerate(keys) if key in places]]
    if _are_hundredths(values):
        notes.append(f"{path.name}: weights up to {values.max():g} are taken for hundredths")
        values = values / 100
    frame, highest = np.unravel_index(values.argmax(), values.shape)
    if (weight := values[frame, highest]) > WEIGHT_MAX:
        told = f"{known[highest]} reaches {weight:g} at frame {frame}"
        notes.append(f"{path.name}: {told}; a shape's weight goes from 0 to 1")
    names = tuple(dict.fromkeys((*ARKIT_NAMES, *known)))
    curves = Curves(values.astype(np.float32), tuple(known), rate).select(names)
    posed = None
    if min(turns) >= 0:
        posed = rows[:, turns]
    return CurveFile(curves, posed, notes=tuple(notes))


def _are_hundredths(values: Float64Array) -> bool:
    high, shown = values.max(initial=0), values[values > 0]
    beyond = shown[shown > PERCENT].sum()
    is_most = beyond > PERCENT_SHARE * (shown.sum() - beyond)
    return bool(high > PERCENT and is_most and values.min(initial=0) > -high)


def _key(name: str) -> str:
    """A name without what stands before a dot, without case and separators, its side written."""
    bare = re.sub(r"([_.\s-])([LR])$", r"\1", name)
    side = {"L": "left", "R": "right"}[name[-1]] if bare != name else ""
    last = bare.rstrip("_. -").rsplit(".", 1)[-1]
    return re.sub(r"[^a-z0-9]", "", last.lower()) + side


def _regular(path: Path, table: _Table, fps: float | None) -> tuple[Float64Array, float, list[str]]:
    """Rows at one distance in time, and their rate."""
    notes = list(table.notes)
    rows, times = table.rows, table.times_s
    lost = np.isnan(rows).all(axis=1)
    if lost.all():
        raise MotionError.about(path, found="no frames", allowed="one or more")
    if lost.any():  # where no face was seen
        at = np.arange(len(rows))
        rows = np.stack([np.interp(at, at[~lost], column[~lost]) for column in rows.T], axis=1)
        notes.append(f"{path.name}: frames without values, {lost.sum()}, are filled in")
    stated = fps if fps is not None else table.fps
    if stated is not None and not 0 < stated <= FPS_MAX:
        raise MotionError.about(
            path, found=f"{stated:g} frames a second", allowed=f"above 0, up to {FPS_MAX:g}"
        )
    if times is not None and len(times) > 1:
        again = np.append(np.diff(times) == 0, False)  # of several at one time the last counts
        if 0 < again.sum() < REPEATED * len(times):
            rows, times = rows[~again], times[~again]
            notes.append(f"{path.name}: {again.sum()} frames whose time comes again are left out")
    if times is not None and len(times) > 1 and (np.diff(times) > 0).all():
        steps = np.diff(times)
        middle = float(np.median(steps))
        if steps.max() < PAUSE * middle:
            own = _nearest_rate((len(times) - 1) / (times[-1] - times[0]), times)
            return rows, stated or own, notes
        rate = _nearest_rate(1 / middle, times[:2])
        if stated is not None and abs(stated * middle - 1) < NEARLY:
            rate = stated
        count = round((times[-1] - times[0]) * rate) + 1
        if count > FRAMES_MAX:
            raise MotionError.about(path, found=f"{count} frames", allowed=f"{FRAMES_MAX}")
        grid = times[0] + np.arange(count) / rate
        rows = np.stack([np.interp(grid, times, column) for column in rows.T], axis=1)
        gap = f"{path.name}: frames are missing, up to {steps.max():.2f} s"
        return rows, stated or rate, [*notes, f"{gap}: filled in at {rate:g} a second"]
    if stated is None:
        stated = ASSUMED_FPS
        said = f"{path.name}: no frame rate in it: taken as {stated:g} a second"
        notes.append(f"{said}; `input_fps` says another")
    return rows, float(stated), notes


def _nearest_rate(rate: float, times: Float64Array) -> float:
    """A rate that films have, where rounded times say no other."""
    slack = max(1e-4, 0.002 / max(float(times[-1] - times[0]), 1e-3)) * rate
    slack = min(slack, 0.02 * rate)
    whole = min(RATES, key=lambda each: abs(each - rate))
    broadcast = whole * 1000 / 1001
    near = [each for each in (whole, broadcast) if abs(each - rate) <= slack]
    return near[0] if near else rate


def _csv_table(path: Path) -> _Table:
    with open_regular(path, CURVES_FILE) as file:
        lines = io.TextIOWrapper(file, encoding="utf-8-sig", errors="replace", newline="")
        try:
            first = lines.readline(100_000)
            mark = max(",;\t", key=first.count)
            header = [name.strip() for name in next(csv.reader([first], delimiter=mark), [])]
            return _rows_of_csv(path, header, csv.reader(lines, delimiter=mark))
        except csv.Error as error:
            raise MotionError.about(path, found=f"not a CSV ({error})") from error


def _rows_of_csv(path: Path, header: list[str], rows: Iterator[list[str]]) -> _Table:
    keys = [_key(name) for name in header]
    clock = next((keys.index(each) for each in _TIMES if each in keys), None)
    wanted = {_key(each) for each in (*ARKIT_NAMES, *OWN, *POSE_COLUMNS)}
    columns = [place for place, key in enumerate(keys) if key in wanted]
    names = [header[place] for place in columns]
    others = [n for n, key in zip(header, keys, strict=True) if key not in {*wanted, *_TIMES}]
    others = [name for name in others if _key(name) not in _ASIDE]
    if not {_key(each) for each in ARKIT_NAMES} & set(keys):
        raise MotionError.about(
            path, found=f"no column of a curve ({', '.join(header)[:120]})", allowed=ALLOWED
        )
    table, clocks = [], []
    for number, row in enumerate(rows, 2):
        if not any(cell.strip() for cell in row):
            continue
        if clock is not None and not any(
            row[column].strip() for column in columns if column < len(row)
        ):
            table.append([np.nan] * len(columns))  # Live Link Face lost the face
            clocks.append(row[clock])
            continue
        try:
            values = [float(row[column].replace(",", ".")) for column in columns]
        except (ValueError, IndexError) as error:
            raise MotionError.about(
                f"{path} row {number}", found="values that are not numbers"
            ) from error
        if not (np.abs(values) < VALUE_MAX).all():  # NaN is not below anything
            raise MotionError.about(f"{path} row {number}", found="NaN, infinity or beyond 1e6")
        table.append(values)
        clocks.append("" if clock is None else row[clock])
    notes = [f"{path.name}: left out {', '.join(others[:6])}: no curves of the head"] * bool(others)
    times = None if clock is None else _times(clocks)
    rows_of = np.array(table, np.float64).reshape(-1, len(columns))
    return _Table(names, rows_of, times, None, tuple(notes))


def _times(clocks: list[str]) -> Float64Array | None:
    """(frame,) s of timecodes or of numbers; None where one is neither."""
    codes = [re.split(r"[:;]", each.strip()) for each in clocks]
    try:
        if all(len(code) == 4 for code in codes):
            return _seconds(np.array(codes, np.float64))
        return _in_seconds(np.array([float(each) for each in clocks]))
    except ValueError:
        return None


def _seconds(codes: Float64Array) -> Float64Array | None:
    """Of hours, minutes, seconds and frames: sixtieths, or those with which steps are regular."""
    if not np.isfinite(codes).all() or not len(codes):
        return None
    most, best, found = float(np.floor(codes[:, 3].max())), -1.0, None
    for base in (SIXTIETHS, 24, 25, 30, 48, 50, 120, 240):
        times = np.unwrap(codes @ [3600, 60, 1, 1 / base], period=86_400.0)
        steps = np.diff(times)
        regular = float(np.isclose(steps, np.median(steps), atol=1e-4).mean()) if len(steps) else 0
        if base > most and regular > best:
            best, found = regular, times
    return found


def _in_seconds(times: Float64Array) -> Float64Array | None:
    """Times of steps that no frame has are thousandths, millionths and so on of a second."""
    if not np.isfinite(times).all() or len(times) < 2:
        return None
    step = float(np.median(np.diff(times)))
    for unit in (1.0, 1e-3, 1e-6, 1e-9):
        if 0 < step * unit < 2:
            return times * unit
    return None


def _npy_table(path: Path) -> _Table:
    rows = read_npy(path, CURVES_FILE)
    if rows.ndim != 2 or rows.shape[1] not in WIDTHS or rows.dtype.kind not in "fiu":
        found = f"{rows.dtype} of shape {rows.shape}"
        raise MotionError.about(path, found=found, allowed=f"(frame, {ALLOWED_WIDTHS}) weights")
    values = rows.astype(np.float64)
    if not (np.abs(values) < VALUE_MAX).all():
        raise MotionError.about(path, found="NaN, infinity or beyond 1e6")
    return _Table(WIDTHS[rows.shape[1]], values, notes=(_order(path),))


def _order(path: Path) -> str:
    return f"{path.name}: no names in it: taken in ARKit's order, from eyeBlinkLeft to tongueOut"


def _parsed(path: Path, text: str) -> Any:
    """JSON; else a JSON a line."""
    lines = text.strip().splitlines()
    first = lines[0].strip() if len(lines) > 1 else ""
    if path.suffix.lower() == ".jsonl" or (first.startswith("{") and first.endswith("}")):
        return [
            parse_json(line, f"{path} line {number}", allowed=ALLOWED, error=MotionError)
            for number, line in enumerate(lines, 1)
            if line.strip()
        ]
    return parse_json(text, path, allowed=ALLOWED, error=MotionError)


def _json_table(path: Path, record: Any) -> _Table:
    facts = record if isinstance(record, dict) else {}
    frames = _first(facts, _FRAMES, list) if facts else record
    if frames is None and facts:
        frames = [record]
    names = next((facts[k] for k in _NAMES if k in facts and are_texts(facts[k])), None)
    if names is not None and names is frames:  # a list of names under a word for frames
        rest = [key for key in _FRAMES if facts.get(key) is not names]
        frames = _first({key: facts[key] for key in rest if key in facts}, _FRAMES, list)
    if not isinstance(frames, list) or not frames:
        raise MotionError.about(path, found="no frames", allowed=ALLOWED)
    if len(frames) > FRAMES_MAX:
        raise MotionError.about(path, found=f"{len(frames)} frames", allowed=f"{FRAMES_MAX}")
    rate = next((n for key in _RATES if (n := finite_number(facts.get(key))) is not None), None)
    frames = list(frames)
    for number, frame in enumerate(frames):
        if isinstance(frame, str):  # as Azure's events hold them
            frames[number] = parse_json(frame, path, allowed=ALLOWED, error=MotionError)
    if all(isinstance(each, dict) and "FrameIndex" in each for each in frames):
        return _azure_table(path, frames)
    times: list[float | None] = []
    found: list[tuple[Sequence[str], list[float]]] = []
    for number, frame in enumerate(frames):
        given, time = _frame(f"{path} frame {number}", frame, names)
        found.append(given)
        times.append(time)
    notes = () if names is not None or found[0][0] not in WIDTHS.values() else (_order(path),)
    columns = list(dict.fromkeys(name for own, _ in found for name in own))
    places = {name: place for place, name in enumerate(columns)}
    rows = np.zeros((len(found), len(columns)))
    for row, (own, values) in zip(rows, found, strict=True):
        row[[places[name] for name in own]] = values
        if not own:  # no face was seen
            row[:] = np.nan
    clock = [each for each in times if each is not None]
    whole = _in_seconds(np.array(clock)) if len(clock) == len(rows) else None
    return _Table(columns, rows, whole, rate, notes)


def _azure_table(path: Path, chunks: list[dict[str, Any]]) -> _Table:
    """Chunks of frames, each with the number of its first, sixty a second.

    Numbers begin again where the chunks of several requests stand in one file.
    """
    rows: dict[int, list[float]] = {}
    begin, notes = 0, list[str]()
    for chunk in chunks:
        start, given = chunk["FrameIndex"], chunk.get("BlendShapes")
        if not isinstance(start, int) or not isinstance(given, list) or start < 0:
            raise MotionError.about(path, found="FrameIndex without BlendShapes", allowed=ALLOWED)
        known = [rows.get(number) for number in range(begin, begin + len(given))]
        if start == 0 and any(b not in (None, a) for a, b in zip(given, known, strict=True)):
            begin = max(rows) + 1
            notes.append(f"{path.name}: FrameIndex begins again: taken to go on at frame {begin}")
        for number, frame in enumerate(given, begin + start):
            rows[number] = _numbers(f"{path} frame {number}", frame, len(AZURE))
    if not rows or max(rows) >= FRAMES_MAX:
        raise MotionError.about(path, found="no frames", allowed="one or more")
    numbers = np.array(sorted(rows))
    table = np.array([rows[number] for number in numbers])
    rate = None if len(numbers) > 1 else ASSUMED_FPS
    return _Table(AZURE, table, numbers / ASSUMED_FPS, rate, tuple(notes))


def _frame(
    about: str, frame: Any, names: Sequence[str] | None
) -> tuple[tuple[Sequence[str], list[float]], float | None]:
    """Names and weights of one frame, and its time where it has one."""
    time = None
    if isinstance(frame, dict):
        clocks = {_key(key): finite_number(value) for key, value in frame.items()}
        time = next((n for key in _TIMES if (n := clocks.get(key)) is not None), None)
        keys = (*_FRAMES, "faceBlendshapes", "face_blendshapes", "categories")
        inner = _first(frame, keys, (list, dict))
        if inner is None and any(key in frame and frame[key] is None for key in keys):
            inner = {}
        if inner is None:
            inner = {
                key: value for key, value in frame.items() if _key(key) not in (*_TIMES, *_ASIDE)
            }
        frame = _first_face(inner)
    if frame is None or (frame == [] and names is None):
        frame = {}
    if isinstance(frame, dict):
        given = [(name, finite_number(value)) for name, value in frame.items()]
        kept = [(name, value) for name, value in given if value is not None]
        return _checked(about, [name for name, _ in kept], [value for _, value in kept]), time
    if isinstance(frame, list) and frame and isinstance(frame[0], dict):
        return _checked(about, *_scored(about, frame)), time
    wide = len(frame) if isinstance(frame, list) else 0
    if names is None and wide not in WIDTHS:
        raise MotionError.about(about, found="no weights by name", allowed=ALLOWED_WIDTHS)
    own = names or WIDTHS[wide]
    return _checked(about, own, _numbers(about, frame, len(own))), time


def _first_face(frame: Any) -> Any:
    """The categories of the first face in a result of MediaPipe, which Python's hold as a list and
    JavaScript's as a record; all else as it is."""
    first = frame[0] if isinstance(frame, list) and frame else None
    if isinstance(first, list) and all(isinstance(each, dict) for each in first):
        return first
    categories = _first(first, ("categories",), list)
    return frame if categories is None else categories


def _scored(about: str, frame: list[Any]) -> tuple[list[str], list[float]]:
    """MediaPipe's categories: a name and a score each."""
    names, values = [], []
    for each in frame:
        name = _first(each, ("categoryName", "category_name", "name"), str) if each else None
        value = next(
            (n for key in _SCORED if (n := finite_number(each.get(key))) is not None), None
        )
        if name is None or value is None:
            raise MotionError.about(about, found="no name with a score", allowed=ALLOWED)
        names.append(name)
        values.append(value)
    return names, values


def _checked(
    about: str, names: Sequence[str], values: list[float]
) -> tuple[Sequence[str], list[float]]:
    if any(abs(value) >= VALUE_MAX for value in values):
        raise MotionError.about(about, found="a value beyond 1e6", allowed="weights")
    if len(set(names)) != len(names):
        raise MotionError.about(about, found="a curve twice", allowed="each once")
    return names, values


def _numbers(about: str, frame: Any, count: int) -> list[float]:
    given = frame if isinstance(frame, list) else []
    values = [value for each in given if (value := finite_number(each)) is not None]
    if len(values) != count or len(given) != count:
        raise MotionError.about(
            about, found=f"{len(given)} values", allowed=f"{count} numbers, one for each name"
        )
    return values


def _first(record: Any, keys: Iterable[str], kind: Any) -> Any:
    given = record if isinstance(record, dict) else {}
    return next((given[key] for key in keys if isinstance(given.get(key), kind)), None)
