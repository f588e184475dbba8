"""Motion on disk: one .npz, self-contained, exact, no pickle.

The head travels along without its identity space. Shapes are stored sparsely: most of them
move a tenth of the face.
"""

from __future__ import annotations

import json
import zipfile
import zlib
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import HeadError, MotionError
from elocute.files.atomic import write_atomically
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion

VERSION = 1
FILE_MAX_BYTES = 2_000_000_000
TEXTS_MAX_BYTES = 1_000_000
# The largest that a file may unfold to: 200 shapes of 200,000 vertices.
UNFOLDED_MAX = 200 * 200_000 * 3


def save_motion(motion: Motion, path: str | Path) -> None:
    """Write a motion. Raises OutputError."""
    head = motion.head
    components, vertices = np.nonzero(head.expression_basis.any(axis=2))
    arrays: dict[str, NDArray[Any]] = {
        "weights": motion.weights,
        "basis/component": components.astype(np.uint16),
        "basis/vertex": vertices.astype(np.uint32),
        "basis/delta": head.expression_basis[components, vertices],
    }
    if motion.rotations is not None:
        arrays["rotations"] = motion.rotations
    texts: dict[str, Any] = {"version": VERSION, "fps": motion.fps}
    for field in fields(HeadModel):
        value = getattr(head, field.name)
        if field.name in _LEFT_OUT:
            continue
        if isinstance(value, np.ndarray):
            arrays[f"head/{field.name}"] = value
        elif field.name == "regions":
            arrays |= {f"region/{name}": indices for name, indices in value.items()}
        else:
            texts[field.name] = value
    arrays["texts"] = np.frombuffer(json.dumps(texts).encode(), np.uint8)
    with write_atomically(path) as draft, draft.open("wb") as file:
        np.savez(file, **arrays)  # pyright: ignore[reportArgumentType]


_LEFT_OUT = ("expression_basis", "identity_basis", "joint_identity_basis")


def load_motion(path: str | Path) -> Motion:
    """Read what `save_motion` wrote. Raises MotionError where it is something else."""
    path = Path(path)
    if not path.is_file():
        raise MotionError.about(path, found="no such file", allowed="a motion (.npz)")
    if path.stat().st_size > FILE_MAX_BYTES:
        raise MotionError.about(path, found="more than 2 GB", allowed="a motion (.npz)")
    try:
        _check_sizes(path)
        with np.load(path, allow_pickle=False) as stored:
            return _unfold({name: stored[name] for name in stored.files})
    except (MotionError, HeadError) as error:
        raise MotionError.about(path, found=str(error)) from error
    except (OSError, ValueError, KeyError, TypeError, IndexError, EOFError, RecursionError,
            zipfile.BadZipFile, zlib.error) as error:  # fmt: skip
        raise MotionError.about(
            path, found="no motion that can be read", allowed="a .npz that Elocute wrote",
            remedy="make one: elocute animate speech.wav -o talk.npz",
        ) from error  # fmt: skip


def _check_sizes(path: Path) -> None:
    """Refuse an archive that would unfold to more than was ever stored."""
    with zipfile.ZipFile(path) as archive:
        total = sum(entry.file_size for entry in archive.infolist())
    if total > 2 * FILE_MAX_BYTES:
        raise MotionError(f"{total / 1e9:.1f} GB inside; allowed: 4 GB")


def _unfold(stored: dict[str, NDArray[Any]]) -> Motion:
    texts = json.loads(stored["texts"].tobytes()[:TEXTS_MAX_BYTES].decode())
    if texts.pop("version") != VERSION:
        raise MotionError("a motion of another version; allowed: version 1")
    fps = texts.pop("fps")
    parts: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in texts.items()
    }
    parts |= {
        name.removeprefix("head/"): value
        for name, value in stored.items()
        if name.startswith("head/")
    }
    parts["regions"] = {
        name.removeprefix("region/"): value
        for name, value in stored.items()
        if name.startswith("region/")
    }
    vertices, joints = len(parts["template"]), len(parts["joint_names"])
    shapes = len(parts["expression_names"])
    if shapes * vertices * 3 > UNFOLDED_MAX:
        raise MotionError(f"{shapes} shapes of {vertices} vertices; allowed: far fewer")
    basis = np.zeros((shapes, vertices, 3), np.float32)
    basis[stored["basis/component"], stored["basis/vertex"]] = stored["basis/delta"]
    head = HeadModel(
        **parts,
        expression_basis=basis,
        identity_basis=np.zeros((0, vertices, 3), np.float32),
        joint_identity_basis=np.zeros((0, joints, 3), np.float32),
    )
    return Motion(head, stored["weights"], fps, stored.get("rotations"))
