"""Registered frames on disk, one file each, so that a sequence of thousands can be resumed."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import CaptureError, InputError
from elocute.files.array_reading import read_npz
from elocute.files.array_writing import write_npz
from elocute.files.json_records import finite_number, parse_json
from elocute.files.reading import FileKind
from elocute.registration.accuracy import SurfaceError
from elocute.registration.model_fit import ModelParameters
from elocute.registration.register import Registration
from elocute.registration.zero_pose import HeadPose

VERSION = 1
ALLOWED = "a registered frame (.npz)"
FRAME_FILE = FileKind(ALLOWED, 500_000_000, CaptureError)
ARRAYS = {"zero": 2, "offsets": 2, "identity": 1, "expression": 1, "translation": 1, "turns": 2}
"""Arrays of a good frame, and how many axes each has."""


@dataclass(frozen=True)
class FrameRecord:
    """How the registration of a frame went.

    Attributes
    ----------
    number
        Of the scan.
    flag
        Why the frame is not used, or "" for a good one.
    surface
        Distance of the scan from the surface.
    landmark_mm
        Mean distance from the landmarks.
    landmarks
        How many good landmarks there were.
    seconds
        Processor time.
    notes
        What had to be removed from the scan.
    """

    number: int
    flag: str
    surface: SurfaceError | None = None
    landmark_mm: float | None = None
    landmarks: int = 0
    seconds: float = 0.0
    notes: tuple[str, ...] = ()


def write_frame(path: Path, key: str, record: FrameRecord, found: Registration | None) -> None:
    """One .npz; key says which template and settings it belongs to. Raises OutputError."""
    texts = {"version": VERSION, "key": key, **asdict(record)}
    arrays: dict[str, NDArray[Any]] = {
        "record": np.frombuffer(json.dumps(texts).encode(), np.uint8)
    }
    if found is not None:
        arrays |= {
            "zero": found.zero.astype(np.float32),
            "offsets": found.offsets.astype(np.float32),
            "identity": found.parameters.identity,
            "expression": found.parameters.expression,
            "translation": found.parameters.pose.translation,
            "turns": found.parameters.pose.turns,
        }
    write_npz(path, arrays)


def read_frame_record(path: Path, key: str) -> FrameRecord | None:
    """The record of a frame; None for no file, a broken one, or one made with another key."""
    try:
        stored = _read(path)
        texts = parse_json(stored["record"].tobytes(), path, allowed=ALLOWED, error=CaptureError)
        if texts.pop("version") != VERSION or texts.pop("key") != key:
            return None
        surface = texts["surface"]
        record = FrameRecord(**texts)
        record = replace(
            record,
            notes=tuple(map(str, record.notes)),
            surface=None if surface is None else SurfaceError(**surface),
        )
        if not _is_sound(record):
            return None
        if not record.flag:
            _good(path, stored)
        return record
    except (InputError, KeyError, TypeError, AttributeError):
        return None


def read_zero(path: Path) -> NDArray[np.float32]:
    """(vertex, 3) m in zero pose, of a frame that was registered. Raises CaptureError."""
    return _good(path, _read(path))["zero"]


def read_pose(path: Path) -> HeadPose:
    """Where the head stood in a frame that was registered. Raises CaptureError."""
    stored = _good(path, _read(path))
    return HeadPose(stored["translation"], stored["turns"])


def read_registration(path: Path, record: FrameRecord) -> Registration | None:
    """A good frame as the start of the next one; None for a flagged one. Raises CaptureError."""
    if record.flag or record.surface is None:
        return None
    stored = _good(path, _read(path))
    parameters = ModelParameters(
        stored["identity"], stored["expression"], HeadPose(stored["translation"], stored["turns"])
    )
    zero, added = stored["zero"].astype(np.float64), stored["offsets"].astype(np.float64)
    # Vertices as posed are not kept: the next frame starts from shape and offsets.
    return Registration(
        zero,
        zero,
        parameters,
        added,
        record.surface,
        record.landmark_mm,
        record.seconds,
        record.notes,
    )


def _read(path: Path) -> dict[str, NDArray[Any]]:
    return read_npz(path, FRAME_FILE)


def _is_sound(record: FrameRecord) -> bool:
    numbers = [record.number, record.landmarks, record.seconds]
    numbers += [] if record.landmark_mm is None else [record.landmark_mm]
    numbers += [] if record.surface is None else list(asdict(record.surface).values())
    return isinstance(record.flag, str) and all(finite_number(n) is not None for n in numbers)


def _good(path: Path, stored: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """The arrays of a good frame, there, finite and of their shapes. Raises CaptureError."""
    for name, axes in ARRAYS.items():
        array = stored.get(name)
        fits = array is not None and array.ndim == axes and array.dtype.kind == "f"
        if not fits or array is None or not np.isfinite(array).all():
            raise CaptureError.about(path, found=f"no {name} that can be used", allowed=ALLOWED)
    zero, offsets = stored["zero"], stored["offsets"]
    if zero.shape != offsets.shape or zero.shape[1:] != (3,) or stored["translation"].shape != (3,):
        raise CaptureError.about(path, found="arrays that do not fit", allowed=ALLOWED)
    return stored
