"""Writes curves as JSON for other programs: the weight of every shape of the head.

    {"format": "elocute curves", "version": 1, "fps": 60.0,
     "names": ["eyeBlinkLeft", …], "frames": [[0, 0.25, …], …]}

`frames` holds a row for each frame, at frame / fps seconds, with a number for each name. Where the
head turns, `joints` names its joints and `rotations` holds, for each frame, a quaternion w, x, y, z
for each of them.
"""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from elocute.errors import MotionError, OutputError
from elocute.files.atomic import write_atomically
from elocute.files.json_records import finite_number, read_record
from elocute.files.reading import FileKind
from elocute.motion.curves import Curves
from elocute.motion.motion import FPS_MAX, Motion
from elocute.one_line_repr import brief

FORMAT, VERSION = "elocute curves", 1
ALLOWED = "curves as `elocute animate -o NAME.json` writes them"
CURVES_FILE = FileKind(ALLOWED, 100_000_000, MotionError)
NAMES_MAX = 10_000


def write_json(
    motion: Motion, path: str | Path, *, sound: object = None, progress: Any = None
) -> None:
    """Write the weights of a motion, to six decimals, one frame a line.

    Raises OutputError.
    """
    facts = {"format": FORMAT, "version": VERSION, "fps": motion.fps, "names": list(motion.names)}
    with write_atomically(path) as draft, draft.open("w", encoding="utf-8") as file:
        file.write(f'{json.dumps(facts)[:-1]}, "frames": [\n')
        for frame, weights in enumerate(motion.weights):
            file.write(f",\n{_numbers(weights)}" if frame else _numbers(weights))
        if motion.rotations is not None:
            file.write(
                f'\n], "joints": {json.dumps(list(motion.head.joint_names))}, "rotations": [\n'
            )
            for frame, turns in enumerate(motion.rotations):
                row = f"[{', '.join(map(_numbers, turns))}]"
                file.write(f",\n{row}" if frame else row)
        file.write("\n]}\n")


def write_curves(curves: Curves, path: str | Path) -> None:
    """Write curves: .json as this module lays them out, .csv with the time of each frame.

    Raises OutputError for another suffix, and a place that cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".csv", ".json"):
        raise OutputError.about(path, found=f"suffix {suffix!r}", allowed=".csv or .json")
    rows = [[round(float(value), 6) for value in row] for row in curves.values]
    with write_atomically(path) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        if suffix == ".csv":
            table = csv.writer(file)
            table.writerow(["time_s", *curves.names])
            table.writerows([f"{frame / curves.fps:.4f}", *row] for frame, row in enumerate(rows))
        else:
            facts = {"format": FORMAT, "version": VERSION, "fps": curves.fps}
            json.dump(facts | {"names": list(curves.names), "frames": rows}, file)
            file.write("\n")


def _numbers(values: NDArray[np.float32]) -> str:
    return f"[{', '.join(f'{value:.6f}'.rstrip('0').rstrip('.') for value in values)}]"


def read_json_curves(path: str | Path) -> Curves:
    """Read curves that were written as .json.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    Curves

    Raises
    ------
    MotionError
        Saying what is wrong with the file, and in which frame.
    """
    record = read_record(path, CURVES_FILE)
    return curves_of_record(path, record)


def curves_of_record(path: str | Path, record: dict[str, Any]) -> Curves:
    """The curves of what such a file holds; path: what messages name. Raises MotionError."""
    _check_format(path, record)
    fps, names, frames = finite_number(record.get("fps")), record.get("names"), record.get("frames")
    if fps is None or not 0 < fps <= FPS_MAX:
        raise MotionError.about(
            path, found="no frame rate in fps", allowed=f"above 0, up to {FPS_MAX:g}"
        )
    if not (are_texts(names) and len(names) <= NAMES_MAX):
        raise MotionError.about(path, found="no list of texts in names", allowed=ALLOWED)
    return Curves(_values(path, frames, len(names)), tuple(names), fps)


def rotations_of_record(
    path: str | Path, record: dict[str, Any], joints: tuple[str, ...]
) -> NDArray[np.float32] | None:
    """Unit quaternions wxyz (frame, joint, 4) of a head's joints in what such a file holds.

    None where it has none. Raises MotionError for other joints, and for anything but a unit
    quaternion for each in each frame.
    """
    if "rotations" not in record:
        return None
    if record.get("joints") != list(joints):
        found = brief(record.get("joints"))
        raise MotionError.about(f"{path} joints", found=found, allowed=", ".join(joints))
    frames = record["rotations"]
    flat = [_flat(each) for each in frames] if isinstance(frames, list) else frames
    turns = _values(f"{path} rotations", flat, 4 * len(joints)).reshape(-1, len(joints), 4)
    if (np.abs(np.linalg.norm(turns, axis=2) - 1) > 1e-3).any():
        raise MotionError.about(
            f"{path} rotations", found="a quaternion of another length", allowed="length 1"
        )
    return turns


def _flat(turns: Any) -> list[Any]:
    """The numbers of quaternions one after another; of anything else something else."""
    parts = turns if isinstance(turns, list) else [turns]
    return [number for part in parts for number in (part if isinstance(part, list) else [None])]


def _check_format(path: str | Path, record: dict[str, Any]) -> None:
    if record.get("format") != FORMAT or record.get("version") != VERSION:
        stated = f"format {brief(record.get('format'))}, version {brief(record.get('version'))}"
        raise MotionError.about(path, found=stated[:120], allowed=ALLOWED)


def are_texts(names: Any) -> TypeGuard[list[str]]:
    """Whether something is a list of one text or more."""
    return isinstance(names, list) and bool(names) and all(isinstance(name, str) for name in names)


def _values(path: str | Path, frames: Any, columns: int) -> np.ndarray:
    if not isinstance(frames, list) or not frames:
        raise MotionError.about(path, found="no frames", allowed="a list of one or more")
    values = np.empty((len(frames), columns), np.float32)
    for number, row in enumerate(frames):
        if not isinstance(row, list) or len(row) != columns:
            raise MotionError.about(
                f"{path} frame {number}",
                found="another number of values than names",
                allowed=f"{columns} numbers",
            )
        for column, value in enumerate(row):
            weight = finite_number(value)
            if weight is None or abs(weight) > 1e6:
                raise MotionError.about(
                    f"{path} frame {number}",
                    found="a value that is not a number",
                    allowed="numbers up to a million",
                )
            values[number, column] = weight
    return values
