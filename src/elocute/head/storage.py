"""Heads on disk: one compressed array file, no pickle."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.errors import HeadError
from elocute.head.model import HeadModel

BASIS_STEP_M = 5e-6
"""Bases are stored in whole steps of 5 micrometres: a tenth of what anyone can see."""

_FLOATS = ("template", "uv", "joint_positions", "joint_identity_basis", "skin_weights",
           "tone_basis")  # fmt: skip
_INDICES = (
    "quads", "uv_quads", "landmarks", "lip_rings", "outer_lip_upper", "outer_lip_lower",
    "inner_lip_upper", "inner_lip_lower", "outer_corners", "inner_corners", "mirror",
)  # fmt: skip
_BASES = ("identity_basis", "expression_basis")
_TEXTS = ("name", "notice")
_TUPLES = ("expression_names", "joint_names", "joint_parents", "material_names")


def save_head(path: Path, head: HeadModel) -> None:
    """Write `head` as .npz; `path` appears only when it is whole."""
    arrays: dict[str, NDArray] = {}
    for name in _FLOATS:
        arrays[name] = getattr(head, name).astype(np.float32)
    for name in _INDICES:
        arrays[name] = getattr(head, name).astype(np.uint16)
    for name in _BASES:
        arrays[name] = _byte_planes(getattr(head, name))
    for name, vertices in head.regions.items():
        arrays[f"region/{name}"] = vertices.astype(np.uint16)
    arrays["material"] = head.material
    arrays["vertex_color"] = head.vertex_color
    arrays["occlusion"] = np.round(head.occlusion * 255).astype(np.uint8)
    texts = {name: getattr(head, name) for name in (*_TEXTS, *_TUPLES)}
    arrays["texts"] = np.frombuffer(json.dumps(texts).encode(), np.uint8)
    partial = path.with_name(f".{path.name}.partial.npz")
    try:
        np.savez_compressed(partial, **arrays)  # pyright: ignore[reportArgumentType]
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def load_head(path: Path) -> HeadModel:
    """Read what `save_head` wrote; HeadError if the file is not a head."""
    if not path.is_file():
        raise HeadError.about(path, found="no such file", allowed="a head (.npz)")
    try:
        with np.load(path, allow_pickle=False) as stored:
            return _head_of({name: stored[name] for name in stored.files})
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        if isinstance(error, HeadError):
            raise
        raise HeadError.about(
            path,
            found=f"not a readable head ({error})",
            allowed="an .npz written by elocute.head.save_head",
        ) from error


def _head_of(stored: dict[str, NDArray]) -> HeadModel:
    texts = json.loads(stored["texts"].tobytes().decode())
    fields: dict = {name: texts[name] for name in _TEXTS}
    fields |= {name: tuple(texts[name]) for name in _TUPLES}
    fields |= {name: stored[name] for name in _FLOATS}
    fields |= {name: stored[name].astype(np.int32) for name in _INDICES}
    fields |= {name: _basis_of(stored[name]) for name in _BASES}
    fields["regions"] = {
        name.removeprefix("region/"): values.astype(np.int32)
        for name, values in stored.items()
        if name.startswith("region/")
    }
    fields["material"] = stored["material"]
    fields["vertex_color"] = stored["vertex_color"]
    fields["occlusion"] = stored["occlusion"].astype(np.float32) / np.float32(255)
    return HeadModel(**fields)


def _byte_planes(basis: NDArray) -> NDArray[np.uint8]:
    """(2, component, vertex, 3): low and high bytes apart, which deflate packs far better."""
    steps = np.round(basis / BASIS_STEP_M)
    if np.abs(steps).max(initial=0) > 32767:
        raise HeadError("a basis moves a vertex by more than 163 mm and cannot be stored")
    raw = steps.astype("<i2").view(np.uint8).reshape(*basis.shape, 2)
    return np.ascontiguousarray(np.moveaxis(raw, -1, 0))


def _basis_of(planes: NDArray[np.uint8]) -> NDArray[np.float32]:
    raw = np.ascontiguousarray(np.moveaxis(planes, 0, -1))
    steps = raw.view("<i2")[..., 0]
    return steps * np.float32(BASIS_STEP_M)
