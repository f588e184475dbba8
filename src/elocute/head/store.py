"""Heads on disk: one compressed array file, no pickle."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import HeadError
from elocute.files.array_reading import read_npz
from elocute.files.array_writing import write_npz
from elocute.files.json_records import as_record, parse_json
from elocute.files.reading import FileKind
from elocute.head.character import character_of_arrays
from elocute.head.looks.look import look_of_record
from elocute.head.model import HeadModel
from elocute.head.model_checks import PLACES
from elocute.head.surface import surface_arrays, surfaces_of_arrays

ALLOWED = "a head (.npz) that elocute.head.save_head wrote"
HEAD_FILE = FileKind(ALLOWED, 500_000_000, HeadError)
BASIS_STEP_M = 5e-6
"""Bases are stored in whole steps of 5 micrometres: a tenth of what anyone can see."""

_FLOATS = (
    "template",
    "uv",
    "joint_positions",
    "joint_identity_basis",
    "skin_weights",
    "tone_basis",
)
_LATER_FLOATS = ("trait_basis", "pose_basis", "joint_regressor")
"""What the first heads were stored without."""
_INDICES = ("quads", "uv_quads", *PLACES)
_BASES = ("identity_basis", "expression_basis")
_TEXTS = ("name", "notice")
_TUPLES = ("expression_names", "joint_names", "joint_parents", "material_names")


def save_head(path: Path, head: HeadModel) -> None:
    """Write a head as .npz; the file appears only when it is complete.

    Parameters
    ----------
    path : Path
        The file.
    head : HeadModel
        What to write. Bases are rounded to 5 µm.

    Raises
    ------
    OutputError
        For a place that cannot be written.
    HeadError
        For a basis that moves a vertex by more than 163 mm.
    """
    arrays: dict[str, NDArray[Any]] = {}
    for name in (*_FLOATS, *_LATER_FLOATS):
        arrays[name] = getattr(head, name).astype(np.float32)
    for name in _INDICES:
        arrays[name] = _short(getattr(head, name))
    for name in _BASES:
        arrays[name] = _byte_planes(getattr(head, name))
    for name, vertices in head.regions.items():
        arrays[f"region/{name}"] = _short(vertices)
    arrays["material"] = head.material
    arrays["vertex_color"] = head.vertex_color
    arrays["occlusion"] = np.round(head.occlusion * 255).astype(np.uint8)
    texts = {name: getattr(head, name) for name in (*_TEXTS, *_TUPLES)}
    if head.look is not None:
        texts["look"] = head.look.record()
    if head.character is not None:
        arrays |= head.character.arrays()
    arrays |= surface_arrays(head.surfaces)
    arrays["texts"] = np.frombuffer(json.dumps(texts).encode(), np.uint8)
    write_npz(path, arrays, compressed=True)


def load_head(path: Path) -> HeadModel:
    """Read a head that `save_head` wrote.

    Parameters
    ----------
    path : Path
        The .npz file.

    Returns
    -------
    HeadModel

    Raises
    ------
    HeadError
        For a file that is missing, damaged or no head.
    """
    stored = read_npz(path, HEAD_FILE)
    try:
        return _head_of(stored)
    except HeadError as error:
        raise HeadError.about(path, found=f"not a readable head ({error})") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        found = f"not a readable head ({str(error)[:80]})"
        raise HeadError.about(path, found=found, allowed=ALLOWED) from error


def _head_of(stored: dict[str, NDArray[Any]]) -> HeadModel:
    texts = as_record(
        parse_json(stored["texts"].tobytes(), "texts", allowed="names", error=HeadError),
        "texts",
        "names",
        HeadError,
    )
    fields: dict[str, Any] = {name: texts[name] for name in _TEXTS}
    fields |= {name: tuple(texts[name]) for name in _TUPLES}
    fields["look"] = look_of_record(texts.get("look"))
    fields["character"] = character_of_arrays(stored)
    fields["surfaces"] = surfaces_of_arrays(stored)
    fields |= {name: stored[name] for name in _FLOATS}
    fields |= {name: stored[name] for name in _LATER_FLOATS if name in stored}
    fields |= {name: _indices(name, stored[name]) for name in _INDICES}
    fields |= {name: _basis_of(name, stored[name]) for name in _BASES}
    fields["regions"] = {
        name.removeprefix("region/"): _indices(name, values)
        for name, values in stored.items()
        if name.startswith("region/")
    }
    fields["material"] = stored["material"]
    fields["vertex_color"] = stored["vertex_color"]
    fields["occlusion"] = stored["occlusion"].astype(np.float32) / np.float32(255)
    return HeadModel(**fields)


def _short(indices: NDArray[np.integer]) -> NDArray[np.integer]:
    """Two bytes an index where that is enough."""
    return indices.astype(np.uint16 if indices.max(initial=0) <= 0xFFFF else np.uint32)


def _indices(name: str, values: NDArray[Any]) -> NDArray[np.int32]:
    if values.dtype.kind not in "iu" or (values.size and not values.max() < 2**31):
        raise HeadError(f"{name[:80]!r} of {values.dtype}; allowed: indices")
    return values.astype(np.int32)


def _byte_planes(basis: NDArray) -> NDArray[np.uint8]:
    """(2, component, vertex, 3): low and high bytes apart, which deflate packs far better."""
    steps = np.round(basis / BASIS_STEP_M)
    if np.abs(steps).max(initial=0) > 32767:
        raise HeadError("a basis moves a vertex by more than 163 mm and cannot be stored")
    raw = steps.astype("<i2").view(np.uint8).reshape(*basis.shape, 2)
    return np.ascontiguousarray(np.moveaxis(raw, -1, 0))


def _basis_of(name: str, planes: NDArray[Any]) -> NDArray[np.float32]:
    if planes.dtype != np.uint8 or planes.ndim != 4 or len(planes) != 2:
        raise HeadError(f"{name} of {planes.dtype}, {planes.shape}; allowed: two planes of bytes")
    raw = np.ascontiguousarray(np.moveaxis(planes, 0, -1))
    steps = raw.view("<i2")[..., 0]
    return steps * np.float32(BASIS_STEP_M)
