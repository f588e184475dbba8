"""The 68 landmarks of a face, and the files that hold them."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.errors import CaptureError
from elocute.files.array_reading import read_npy
from elocute.files.atomic import write_atomically
from elocute.files.json_records import parse_json
from elocute.files.picked_points import PICKED_SUFFIX, picked_points
from elocute.files.reading import FileKind, read_text
from elocute.registration.landmark_formats import (
    ALLOWED,
    JAW_COUNT,
    LANDMARK_COUNT,
    listed_points,
    ljson_points,
    pts_points,
    whole_face,
)

GOOD_MIN = 20
"""Landmarks below which a scan is flagged."""
CONFIDENT = 0.3
LANDMARK_FILE = FileKind(ALLOWED, 1_000_000, CaptureError)
BESIDE_SUFFIXES = (".ljson", ".json", ".pts", PICKED_SUFFIX)
"""In the order in which they are looked for beside a scan."""
LANDMARK_SUFFIXES = (*BESIDE_SUFFIXES, ".npy", ".txt")
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
    .ljson   the Menpo project's, versions 1 to 3, by its labels (`landmark_formats`)
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


def _points(path: Path, suffix: str) -> tuple[list[Any], Any]:
    """The points of a file, and confidences where it has them."""
    if suffix == ".npy":
        array = read_npy(path, LANDMARK_FILE)
        return array.tolist() if array.ndim == 2 else [], None
    text = read_text(path, LANDMARK_FILE)
    if suffix == ".json":
        return _json_points(text, path)
    if suffix == PICKED_SUFFIX:
        return picked_points(text, path, CaptureError), None
    readers = {".ljson": ljson_points, ".pts": pts_points, ".txt": listed_points}
    return readers[suffix](text, path), None
