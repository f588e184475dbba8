"""Motion on disk: one .npz, self-contained, exact, no pickle.

The head travels along without its identity space; its look is named. Shapes are
stored sparsely: most of them move a tenth of the face.
"""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import HeadError, MotionError
from elocute.files.array_reading import read_npz
from elocute.files.array_writing import write_npz
from elocute.files.json_records import as_record, finite_number, parse_json
from elocute.files.reading import FileKind
from elocute.files.unpacked_size import unpacked_limit
from elocute.head.character import character_of_arrays
from elocute.head.looks.look import look_of_record
from elocute.head.model import HeadModel
from elocute.head.surface import surface_arrays, surfaces_of_arrays
from elocute.motion.motion import Motion, check_motion, check_reach

VERSION = 1
TEXTS_MAX_BYTES = 1_000_000
FRAMES_MAX = 10_000_000
ALLOWED = "a motion (.npz) that Elocute wrote"
REMEDY = "make one: elocute animate speech.wav -o talk.npz"
MOTION_FILE = FileKind(ALLOWED, 2_000_000_000, MotionError, REMEDY)


def save_motion(motion: Motion, path: str | Path) -> None:
    """Write a motion as .npz: exact, with its head, but without the head's identity space.

    Parameters
    ----------
    motion : Motion
        What to write.
    path : str or Path
        The file; one of that name is replaced.

    Raises
    ------
    OutputError
        For a place that cannot be written.
    """
    check_motion(motion)
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
        elif field.name == "look":
            texts["look"] = head.look.record() if head.look else None
        elif field.name == "character":
            arrays |= head.character.arrays() if head.character else {}
        elif field.name == "surfaces":
            arrays |= surface_arrays(head.surfaces)
        elif field.name == "regions":
            arrays |= {f"region/{name}": indices for name, indices in value.items()}
        else:
            texts[field.name] = value
    arrays["texts"] = np.frombuffer(json.dumps(texts).encode(), np.uint8)
    write_npz(path, arrays)


_LEFT_OUT = ("expression_basis", "identity_basis", "joint_identity_basis")


def load_motion(path: str | Path) -> Motion:
    """Read a motion that `save_motion` wrote.

    Parameters
    ----------
    path : str or Path
        The .npz file.

    Returns
    -------
    Motion

    Raises
    ------
    MotionError
        For a file that is missing, damaged or no motion, and one that goes where no face is.
    """
    stored = read_npz(path, MOTION_FILE)
    # As many bytes as the archive may unpack to may its shapes unfold to.
    limit = unpacked_limit(Path(path).stat().st_size)
    try:
        return _unfold(stored, limit)
    except (MotionError, HeadError) as error:
        raise MotionError.about(path, found=str(error)) from error
    except (ValueError, KeyError, TypeError, IndexError, AttributeError) as error:
        raise MotionError.about(
            path, found="not a readable motion", allowed=ALLOWED, remedy=REMEDY
        ) from error


def _texts(stored: dict[str, NDArray[Any]]) -> dict[str, Any]:
    raw = stored["texts"]
    if raw.nbytes > TEXTS_MAX_BYTES:
        raise MotionError(f"names of {raw.nbytes} bytes; allowed: {TEXTS_MAX_BYTES}")
    record = parse_json(raw.tobytes(), "texts", allowed="names", error=MotionError)
    return as_record(record, "texts", "names", MotionError)


def _unfold(stored: dict[str, NDArray[Any]], limit: int) -> Motion:
    texts = _texts(stored)
    if texts.pop("version") != VERSION:
        raise MotionError("a motion of another version; allowed: version 1")
    fps = finite_number(texts.pop("fps"))
    if fps is None:
        raise MotionError("fps that is not a number")
    parts: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in texts.items()
    }
    parts["look"] = look_of_record(parts.get("look"))
    parts["character"] = character_of_arrays(stored)
    parts["surfaces"] = surfaces_of_arrays(stored)
    parts |= _named(stored, "head/") | {"regions": _named(stored, "region/")}
    vertices, joints = len(parts["template"]), len(parts["joint_names"])
    weights = stored["weights"]
    if len(weights) > FRAMES_MAX:
        raise MotionError(f"{len(weights)} frames; allowed: up to {FRAMES_MAX}")
    head = HeadModel(
        **parts,
        expression_basis=_basis(stored, len(parts["expression_names"]), vertices, limit),
        identity_basis=np.zeros((0, vertices, 3), np.float32),
        joint_identity_basis=np.zeros((0, joints, 3), np.float32),
    )
    motion = Motion(head, weights, fps, stored.get("rotations"))
    check_reach(motion)
    return motion


def _named(stored: dict[str, NDArray[Any]], prefix: str) -> dict[str, NDArray[Any]]:
    """The arrays below a prefix, by what follows it."""
    return {
        name.removeprefix(prefix): value
        for name, value in stored.items()
        if name.startswith(prefix)
    }


def _basis(
    stored: dict[str, NDArray[Any]], shapes: int, vertices: int, limit: int
) -> NDArray[np.float32]:
    """(component, vertex, 3) m of the sparse shapes. Raises MotionError for too many of them."""
    if shapes * vertices * 12 > limit:
        raise MotionError(
            f"{shapes} shapes of {vertices} vertices; allowed: fewer, for a file of this size"
        )
    kinds = {"weights": "f", "basis/component": "iu", "basis/vertex": "iu"}
    if any(stored[name].dtype.kind not in allowed for name, allowed in kinds.items()):
        raise MotionError("weights or shapes of the wrong type; allowed: floats and indices")
    basis = np.zeros((shapes, vertices, 3), np.float32)
    basis[stored["basis/component"], stored["basis/vertex"]] = stored["basis/delta"]
    return basis
