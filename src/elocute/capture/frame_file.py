"""One registered frame on disk: what makes a sequence of thousands resumable."""

from __future__ import annotations

import json
import zipfile
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.capture.errors_mm import SurfaceError
from elocute.capture.model_fit import Shape
from elocute.capture.pose import Pose
from elocute.capture.register import Registration
from elocute.files.atomic import write_atomically

VERSION = 1
TEXT_MAX_BYTES = 100_000


@dataclass(frozen=True)
class FrameRecord:
    """How a frame went.

    flag  why the frame is not used, or "" for a good one
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
            "zero": found.zero.astype(np.float32), "offsets": found.offsets.astype(np.float32),
            "identity": found.shape.identity, "expression": found.shape.expression,
            "translation": found.shape.pose.translation, "turns": found.shape.pose.turns,
        }  # fmt: skip
    with write_atomically(path) as draft, draft.open("wb") as file:
        np.savez(file, **arrays)  # pyright: ignore[reportArgumentType]


def read_frame_record(path: Path, key: str) -> FrameRecord | None:
    """How the frame went; None for no file, a broken one, or one made with another key."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            texts = json.loads(stored["record"].tobytes()[:TEXT_MAX_BYTES])
        if texts.pop("version") != VERSION or texts.pop("key") != key:
            return None
        surface = texts["surface"]
        record = FrameRecord(**texts)
        return replace(
            record, notes=tuple(record.notes),
            surface=None if surface is None else SurfaceError(**surface),
        )  # fmt: skip
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
        return None


def read_zero(path: Path) -> NDArray[np.float32]:
    """(vertex, 3) m in zero pose, of a frame that was registered."""
    with np.load(path, allow_pickle=False) as stored:
        return stored["zero"]


def read_pose(path: Path) -> Pose:
    """Where the head stood in a frame that was registered."""
    with np.load(path, allow_pickle=False) as stored:
        return Pose(stored["translation"], stored["turns"])


def read_registration(path: Path, record: FrameRecord) -> Registration | None:
    """A good frame as the start of the next one; None for a flagged one."""
    if record.flag or record.surface is None:
        return None
    with np.load(path, allow_pickle=False) as stored:
        shape = Shape(
            stored["identity"], stored["expression"], Pose(stored["translation"], stored["turns"])
        )
        zero, added = stored["zero"].astype(np.float64), stored["offsets"].astype(np.float64)
    # Vertices as posed are not kept: the next frame starts from shape and offsets.
    return Registration(
        zero, zero, shape, added, record.surface, record.landmark_mm, record.seconds, record.notes
    )
