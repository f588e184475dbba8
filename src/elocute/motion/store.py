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

from elocute.errors import HeadError, MotionError, OutputError
from elocute.files.array_reading import read_npz
from elocute.files.array_writing import write_npz
from elocute.files.json_records import as_record, finite_number, parse_json
from elocute.files.reading import FileKind
from elocute.files.unpacked_size import unpacked_limit
from elocute.head.builtin import load_builtin_head
from elocute.head.character import character_of_arrays
from elocute.head.looks.look import look_of_record
from elocute.head.model import HeadModel
from elocute.head.surface import surface_arrays, surfaces_of_arrays
from elocute.motion.motion import Motion, check_motion, check_reach

VERSION = 1
TEXTS_MAX_BYTES = 1_000_000
FRAMES_MAX = 10_000_000
ANIMATION = "built-in"
ALLOWED = "a motion (.npz) that Elocute wrote"
REMEDY = "make one: elocute animate speech.wav -o talk.npz"
MOTION_FILE = FileKind(ALLOWED, 2_000_000_000, MotionError, REMEDY)


def save_motion(motion: Motion, path: str | Path, *, with_head: bool = True) -> None:
    """Write a motion as .npz: exact, with its head, but without the head's identity space.

    Parameters
    ----------
    motion : Motion
        What to write.
    path : str or Path
        The file; one of that name is replaced.
    with_head : bool
        Whether the head goes along. Without it the file has what moves it alone, deflated: it is
        read back on the built-in head, with its own face and look, and no character.

    Raises
    ------
    OutputError
        For a place that cannot be written, and a head that is left out and has other shapes or
        joints than the built-in one.
    """
    check_motion(motion)
    head = motion.head
    if not with_head:
        _save_animation(motion, path)
        return
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


def _save_animation(motion: Motion, path: str | Path) -> None:
    builtin = load_builtin_head()
    for what, own, known in (
        ("shapes", motion.names, builtin.expression_names),
        ("joints", motion.head.joint_names, builtin.joint_names),
    ):
        if own != known:
            raise OutputError.about(
                path,
                found=f"{motion.head.name}, which has {what} of its own",
                allowed="the built-in head's, where the head is left out",
            )
    used = np.flatnonzero(motion.weights.any(axis=0))
    texts = {"version": VERSION, "fps": motion.fps, "head": ANIMATION}
    texts["shapes"] = [motion.names[index] for index in used]
    arrays = {
        "weights": motion.weights[:, used],
        "texts": np.frombuffer(json.dumps(texts).encode(), np.uint8),
    }
    if motion.rotations is not None:
        arrays["rotations"] = motion.rotations
    write_npz(path, arrays, compressed=True)


def _animation(stored: dict[str, NDArray[Any]], texts: dict[str, Any], fps: float) -> Motion:
    """What `_save_animation` left of a motion, on the built-in head."""
    head = load_builtin_head()
    columns = [head.expression_index(name) for name in texts["shapes"]]
    values = stored["weights"]
    if values.ndim != 2 or values.shape[1] != len(columns) or len(set(columns)) != len(columns):
        raise MotionError("weights that do not fit the names of shapes")
    weights = np.zeros((len(values), len(head.expression_names)), np.float32)
    weights[:, columns] = values
    return Motion(head, weights, fps, stored.get("rotations"))


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
    if len(stored["weights"]) > FRAMES_MAX:
        raise MotionError(f"{len(stored['weights'])} frames; allowed: up to {FRAMES_MAX}")
    if texts.get("head") == ANIMATION:
        return _animation(stored, texts, fps)
    parts: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in texts.items()
    }
    parts["look"] = look_of_record(parts.get("look"))
    parts["character"] = character_of_arrays(stored)
    parts["surfaces"] = surfaces_of_arrays(stored)
    parts |= _named(stored, "head/") | {"regions": _named(stored, "region/")}
    vertices, joints = len(parts["template"]), len(parts["joint_names"])
    weights = stored["weights"]
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
