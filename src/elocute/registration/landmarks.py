"""The 68 landmarks of a face, and the files that hold them: ours, and those of others.

A .ljson may hold its points in any order; its labels say which are the jaw, which the mouth.
Landmarker.io, for one, writes parts in the order of its template. Points are put where iBUG has
them, by label; without labels the order is taken as iBUG's. Left and right are the picture's, as
Menpo's labels have it: left_eyebrow is points 17 to 21.

    version 1  {"groups": [{"label": "jaw", "landmarks": [{"point": [x, y, z]}, …]}, …]}
    version 2  {"landmarks": {"points": [[x, y, z], …]}, "labels": [{"label", "mask"}, …]}
    version 3  {"groups": {"PTS": {"landmarks": …, "labels": …}, …}}, each as version 2
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.errors import CaptureError
from elocute.files.array_reading import read_npy
from elocute.files.atomic import write_atomically
from elocute.files.json_records import finite_number, parse_json
from elocute.files.picked_points import PICKED_SUFFIX, picked_points
from elocute.files.reading import FileKind, read_text

LANDMARK_COUNT, JAW_COUNT = 68, 17
ALLOWED = (
    f"{LANDMARK_COUNT} points of x, y, z in the unit of the scan, or "
    f"{LANDMARK_COUNT - JAW_COUNT} without the jaw line"
)
LandmarkPoint = list[float] | None
"""x, y, z; None for a point that is not seen."""

PLACES: dict[str, range] = {
    "jaw": range(17),
    "chin": range(17),
    "left_eyebrow": range(17, 22),
    "right_eyebrow": range(22, 27),
    "nose": range(27, 36),
    "nose_bridge": range(27, 31),
    "upper_nose": range(27, 31),
    "nose_tip": range(31, 36),
    "lower_nose": range(31, 36),
    "nostrils": range(31, 36),
    "left_eye": range(36, 42),
    "right_eye": range(42, 48),
    "mouth": range(48, 68),
    "outer_mouth": range(48, 60),
    "outer_lips": range(48, 60),
    "inner_mouth": range(60, 68),
    "inner_lips": range(60, 68),
}
"""Where the points of a label lie in iBUG's order."""
KNOWN_GROUPS = ("pts", "ibug68", "ibug_68", "face_ibug_68", "face_ibug_68_trimesh")
NAMED_AT_MOST = 8


def ljson_points(text: str, path: Path) -> list[LandmarkPoint]:
    """The 68 points of a .ljson in iBUG's order. Raises CaptureError for a file of another kind."""
    record = parse_json(text, path, allowed=ALLOWED, error=CaptureError)
    if not isinstance(record, dict):
        raise _refused(path, f"JSON of a {type(record).__name__}")
    groups = record.get("groups")
    if isinstance(groups, list):
        return _placed(path, *_first_version(path, groups))
    if isinstance(groups, dict):
        return _placed(path, *_chosen_group(path, groups))
    return _placed(path, *_points_and_labels(path, record))


def listed_points(text: str, path: Path) -> list[LandmarkPoint]:
    """The points of a .txt, x y z in each line, with white space or commas between them.

    Raises CaptureError for a file of another kind.
    """
    rows = [line.replace(",", " ").split() for line in text.splitlines()]
    rows = [row for row in rows if row and not row[0].startswith("#")]
    try:
        points = [[float(word) for word in row] for row in rows]
    except ValueError:
        raise _refused(path, "words that are no numbers") from None
    if any(len(row) != 3 for row in points):
        raise _refused(path, "lines of other than x, y, z")
    return whole_face(points, path)


def pts_points(text: str, path: Path) -> list[LandmarkPoint]:
    """The points of a .pts, `n_points: 68 { x y z … }`; `nan` is a point that is not seen.

    Raises CaptureError for a file of another kind.
    """
    inside = re.search(r"\{([^{}]*)\}", text)
    if inside is None:
        raise _refused(path, "no { … }")
    rows = [line.split() for line in inside[1].splitlines() if line.strip()]
    promised = re.search(r"n_points:\s*(\d{1,9})\b", text[: inside.start()])
    if promised and int(promised[1]) != len(rows):
        raise _refused(path, f"{len(rows)} points where n_points says {promised[1]}")
    try:
        points = [[float(word) for word in row] for row in rows]
    except ValueError:
        raise _refused(path, "words that are no numbers") from None
    unseen = [any(value != value for value in row) for row in points]
    return _placed(path, [None if u else p for p, u in zip(points, unseen, strict=True)], [])


LabelledPoints = list[tuple[str, list[int]]]


def _first_version(path: Path, groups: list[Any]) -> tuple[list[LandmarkPoint], LabelledPoints]:
    points: list[LandmarkPoint] = []
    labels: LabelledPoints = []
    for group in groups:
        marks = group.get("landmarks") if isinstance(group, dict) else None
        if not isinstance(marks, list) or not all(isinstance(mark, dict) for mark in marks):
            raise _refused(path, "a group without landmarks")
        places = list(range(len(points), len(points) + len(marks)))
        labels.append((_name(group.get("label")), places))
        points += [_row(path, mark.get("point")) for mark in marks]
    return points, labels


def _chosen_group(path: Path, groups: dict[str, Any]) -> tuple[list[LandmarkPoint], LabelledPoints]:
    """The group called as iBUG's are, else the only one with 68 points, else the only one."""
    read = {
        name: _points_and_labels(path, group)
        for name, group in groups.items()
        if isinstance(group, dict)
    }
    named = [name for name in read if _name(name) in KNOWN_GROUPS]
    whole = [name for name in read if len(read[name][0]) == LANDMARK_COUNT]
    for choice in (named, whole, list(read)):
        if len(choice) == 1:
            return read[choice[0]]
    sizes = [f"{name} ({len(read[name][0])} points)" for name in list(read)[:NAMED_AT_MOST]]
    raise _refused(path, f"groups {', '.join(sizes) or 'none'}")


def _points_and_labels(
    path: Path, record: dict[str, Any]
) -> tuple[list[LandmarkPoint], LabelledPoints]:
    marks = record.get("landmarks", record)
    points = marks.get("points") if isinstance(marks, dict) else None
    if not isinstance(points, list):
        raise _refused(path, "no points")
    rows = [_row(path, point) for point in points]
    labels = record.get("labels") or []
    if not isinstance(labels, list):
        raise _refused(path, "labels that are no list")
    return rows, [_label(path, label, len(rows)) for label in labels]


def _label(path: Path, label: Any, count: int) -> tuple[str, list[int]]:
    mask = label.get("mask") if isinstance(label, dict) else None
    whole = isinstance(mask, list) and all(type(place) is int for place in mask)
    if mask is None or not whole or not all(0 <= place < count for place in mask):
        raise _refused(path, "a label whose mask is no list of its points")
    return _name(label.get("label")), mask


def _placed(path: Path, points: list[LandmarkPoint], labels: LabelledPoints) -> list[LandmarkPoint]:
    """Rows in iBUG's order: by labels that are known, else as they come."""
    known = [(name, mask) for name, mask in labels if name in PLACES]
    if not known:
        return whole_face(points, path, _label_list(labels))
    placed: dict[int, LandmarkPoint] = {}
    for name, mask in known:
        places = PLACES[name]
        if len(mask) != len(places):
            raise _refused(path, f"{len(mask)} points of {name}, which has {len(places)}")
        placed |= {place: points[index] for place, index in zip(places, mask, strict=True)}
    return [placed.get(place) for place in range(LANDMARK_COUNT)]


def whole_face(points: list[Any], path: Path, labels: str = "") -> list[Any]:
    """68 points; the 51 that FLAME's and MeshLab's users pick leave out the jaw line.

    Raises CaptureError for another number.
    """
    if len(points) == LANDMARK_COUNT - JAW_COUNT:
        points = [None] * JAW_COUNT + points
    if len(points) != LANDMARK_COUNT:
        raise _refused(path, f"{len(points)} points{labels}")
    return points


def _row(path: Path, point: Any) -> LandmarkPoint:
    if point is None or (isinstance(point, list) and None in point):
        return None
    values = [finite_number(value) for value in point] if isinstance(point, list) else []
    if len(values) != 3 or None in values:
        raise _refused(path, f"a point of {len(values)} numbers")
    return [value for value in values if value is not None]


def _name(label: Any) -> str:
    return re.sub(r"[^a-z0-9]+", "_", label.lower()) if isinstance(label, str) else ""


def _label_list(labels: Iterable[tuple[str, list[int]]]) -> str:
    names = [name for name, _ in labels][:NAMED_AT_MOST]
    return f" labelled {', '.join(names)}" if names else ""


def _refused(path: Path, found: str) -> CaptureError:
    return CaptureError.about(
        path, found=f"no landmarks that can be used ({found})", allowed=ALLOWED
    )


GOOD_MIN = 20
"""Landmarks below which a scan is flagged."""
CONFIDENT = 0.3
LANDMARK_FILE = FileKind(ALLOWED, 1_000_000, CaptureError)
JAW_LINE = range(JAW_COUNT)
"""The contour of the jaw: where it lies depends on the view, so it counts little."""


@dataclass(frozen=True, eq=False)
class Landmarks:
    """The 68 landmarks of iBUG's scheme, in space.

    Attributes
    ----------
    points
        (68, 3) m; NaN where one is unknown.
    confidence
        (68,) 0 to 1; 0 where a point is unknown.

    Raises
    ------
    CaptureError
        For other shapes.
    """

    points: Float64Array
    confidence: Float64Array

    def __post_init__(self) -> None:
        points = np.array(self.points, np.float64)
        confidence = np.array(self.confidence, np.float64)
        if points.shape != (LANDMARK_COUNT, 3) or confidence.shape != (LANDMARK_COUNT,):
            raise CaptureError(
                f"landmarks: found {points.shape} points, {confidence.shape} confidences; "
                f"allowed: ({LANDMARK_COUNT}, 3) and ({LANDMARK_COUNT},)"
            )
        unknown = ~np.isfinite(points).all(axis=1) | ~np.isfinite(confidence)
        confidence[unknown], points[unknown] = 0, np.nan
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "confidence", np.clip(confidence, 0, 1))

    @property
    def good(self) -> NDArray[np.bool_]:
        """(68,) those confident enough to be used."""
        return self.confidence >= CONFIDENT

    @property
    def enough(self) -> bool:
        """Whether there are enough good ones for a registration."""
        return int(self.good.sum()) >= GOOD_MIN


def no_landmarks() -> Landmarks:
    """68 unknown points."""
    return Landmarks(np.full((LANDMARK_COUNT, 3), np.nan), np.zeros(LANDMARK_COUNT))


def read_landmarks(path: str | Path, unit_m: float = 1.0) -> Landmarks:
    """68 points from a file, in the unit of its scan; 51 are those without the jaw line.

    .json    {"points": [[x, y, z], …], "confidence": [c, …]}; null for a point not known
    .ljson   the Menpo project's, versions 1 to 3, by its labels
    .pts     "version: 1, n_points: 68 { x y z … }"
    .pp      points picked in MeshLab, by their names where these are numbers
    .npy     (68 or 51, 3); .txt: x y z in each line

    Raises CaptureError for another count, flat points and anything that cannot be read.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in LANDMARK_SUFFIXES:
        allowed = " ".join(LANDMARK_SUFFIXES)
        raise CaptureError.about(path, found="no landmarks", allowed=allowed)
    try:
        points, confidence = _points(path, suffix)
        points = whole_face(points, path)
        points = [[math.nan] * 3 if p is None or None in p else p for p in points]
        array = np.array(points, np.float64)
        if array.shape != (LANDMARK_COUNT, 3):
            raise ValueError(f"shape {array.shape}")
        if confidence is None:
            confidence = np.isfinite(array).all(axis=1).astype(np.float64)
        with np.errstate(over="ignore"):  # what is infinite then counts as not known
            return Landmarks(unit_m * array, np.array(confidence, np.float64))
    except CaptureError:
        raise
    except (ValueError, TypeError, AttributeError, IndexError, OverflowError) as error:
        reason = " ".join(str(error).split())[:80]
        raise CaptureError.about(
            path, found=f"no landmarks that can be used ({reason})", allowed=ALLOWED
        ) from error


def write_landmarks(path: str | Path, landmarks: Landmarks) -> None:
    """Write a .json that `read_landmarks` reads, in metres. Raises OutputError."""
    rows = np.round(landmarks.points, 7).tolist()
    record = {
        "points": [row if all(map(math.isfinite, row)) else None for row in rows],
        "confidence": np.round(landmarks.confidence, 4).tolist(),
    }
    with write_atomically(path) as draft:
        draft.write_text(json.dumps(record) + "\n", encoding="utf-8")


def _json_points(text: str, path: Path) -> tuple[list[Any], Any]:
    """Points and confidence of our own record; a .ljson under the name .json is read as one."""
    record = parse_json(text, path, allowed="landmarks", error=CaptureError)
    if "points" not in record:
        return ljson_points(text, path), record.get("confidence")
    return record["points"], record.get("confidence")


def _meshlab_points(text: str, path: Path) -> list[LandmarkPoint]:
    return picked_points(text, path, CaptureError)


def _points(path: Path, suffix: str) -> tuple[list[Any], Any]:
    """The points of a file, and confidences where it has them."""
    if suffix == ".npy":
        array = read_npy(path, LANDMARK_FILE)
        return array.tolist() if array.ndim == 2 else [], None
    text = read_text(path, LANDMARK_FILE)
    read = TEXT_READERS[suffix](text, path)
    return read if isinstance(read, tuple) else (read, None)


TEXT_READERS: dict[str, Callable[[str, Path], list[Any] | tuple[list[Any], Any]]] = {
    ".ljson": ljson_points,
    ".json": _json_points,
    ".pts": pts_points,
    PICKED_SUFFIX: _meshlab_points,
    ".txt": listed_points,
}
"""Readers of points, or of points and confidences, by suffix: all that is needed to add one."""
# In the order in which they are looked for beside a scan, where a .txt may be anything.
BESIDE_SUFFIXES = tuple(suffix for suffix in TEXT_READERS if suffix != ".txt")
LANDMARK_SUFFIXES = (*TEXT_READERS, ".npy")
