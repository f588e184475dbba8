"""The parts of a mesh file with their materials: surfaces as other programs dress them.

glTF is read by `gltf_meshes`, other files by `mesh_file`. Nothing outside a file is opened but
the materials and pictures beside an .obj or .ply (`materials`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError
from elocute.files.reading import bytes_text
from elocute.files.unpacked_size import unpacked_limit
from elocute.meshes.gltf_arrays import (
    FOR_EACH_BYTE,
    MOST_BYTES,
    GltfArrays,
    TooMuchError,
    draco_arrays,
    draco_is_here,
    has_draco,
)
from elocute.meshes.gltf_document import (
    SUFFIXES as GLTF_SUFFIXES,
    GltfDocument,
    gltf_document,
    read_gltf_bytes,
)
from elocute.meshes.gltf_meshes import gltf_parts
from elocute.meshes.materials import Look, mesh_looks
from elocute.meshes.mesh_file import GREY, PARSERS, MeshPart, check_picture, read_mesh_file
from elocute.meshes.polygon_mesh import PolygonMesh

SUFFIXES = (*PARSERS, *GLTF_SUFFIXES)
UNPACKED_MIN_BYTES = 4 * 8192 * 8192
PARTS_MAX = 1000


def read_mesh_parts(
    path: str | Path, *, max_bytes: int, error: type[InputError], finite: bool = True
) -> tuple[MeshPart, ...]:
    """Read an .obj, .ply, .stl, .glb, .gltf, .vrm or .fbx with its materials: one part at least.

    finite: whether an .obj, .ply or .stl with vertices that are not finite is refused.

    Warns of materials and pictures that are named but not there, and colours left out. Raises an
    `error` for a file that is missing, too large, damaged, compressed in a way that is not read,
    not a mesh, or with pictures that unpack to far more than their size; MachineError for an .fbx
    where Blender's module is not installed.
    """
    path = Path(path)
    if path.suffix.lower() in GLTF_SUFFIXES:
        document = gltf_document(read_gltf_bytes(path, max_bytes, error), path, error=error)
        return document_parts(document, path, error)
    mesh = read_mesh_file(path, max_bytes=max_bytes, error=error)
    return _checked(_mesh_parts(mesh, path, error), path, error, finite)


def document_arrays(document: GltfDocument, path: Path, error: type[InputError]) -> GltfArrays:
    """The arrays of a glTF file that was read; path: its name. Raises an `error` for what Draco
    packed where that is not read."""
    if has_draco(document):
        if not draco_is_here():
            raise error.about(
                path,
                found="a mesh packed by Draco",
                allowed="vertices as they are",
                remedy="export it without compression, or pip install 'elocute[draco]'",
            )
        return draco_arrays(document, path, error)
    return GltfArrays(document)


def document_parts(
    document: GltfDocument, path: Path, error: type[InputError], arrays: GltfArrays | None = None
) -> tuple[MeshPart, ...]:
    """The parts of a glTF file that was read; path: its name. Raises as `read_mesh_parts`."""
    arrays = arrays or document_arrays(document, path, error)
    _check_pictures(document, path, error)
    budget = unpacked_limit(len(document.data), UNPACKED_MIN_BYTES)
    try:
        with np.errstate(all="ignore"):  # what is not finite is refused
            return _checked(gltf_parts(document, arrays, str(path), budget, error), path, error)
    except (InputError, MemoryError):
        raise
    except TooMuchError as problem:
        raise error.about(
            path,
            found="meshes that take more memory than its size allows",
            allowed=f"{bytes_text(MOST_BYTES)}, and {FOR_EACH_BYTE} bytes for each of the file",
        ) from problem
    except Exception as problem:  # records may hold anything where glTF wants something else
        allowed = f"a mesh ({' '.join(SUFFIXES)})"
        raise error.about(path, found="no mesh that can be read", allowed=allowed) from problem


def _checked(
    parts: Iterable[MeshPart], path: Path, error: type[InputError], finite: bool = True
) -> tuple[MeshPart, ...]:
    """The parts, one at least. Raises for vertices that are not finite."""
    checked = []
    for part in parts:
        if len(checked) == PARTS_MAX:
            raise error.about(path, found="too many parts", allowed=f"up to {PARTS_MAX}")
        if finite and not np.isfinite(part.vertices).all():
            raise error.about(path, found="numbers that are not finite", allowed="a finite mesh")
        checked.append(part)
    if not checked:
        raise error.about(path, found="no triangles", allowed="a mesh")
    return tuple(checked)


def _check_pictures(document: GltfDocument, path: Path, error: type[InputError]) -> None:
    """Raise for a picture that cannot be read."""
    views = document.records("bufferViews")
    for image in document.records("images")[:PARTS_MAX]:
        view = image.get("bufferView")
        if document.binary is None or not isinstance(view, int) or not 0 <= view < len(views):
            continue
        if views[view].get("buffer") == 0:
            start = int(views[view].get("byteOffset", 0))
            data = document.binary[start : start + int(views[view]["byteLength"])]
            check_picture(bytes(data), path, error)


def _mesh_parts(mesh: PolygonMesh, path: Path, error: type[InputError]) -> Iterator[MeshPart]:
    """The triangles of each material; where it has a picture, those without a place in it apart."""
    rows, face = mesh.fan()
    number = mesh.materials[face]
    placed = (mesh.places[rows] >= 0).all(axis=1)
    groups = [(int(n), has) for n in np.unique(number)[: PARTS_MAX + 1] for has in (True, False)]
    looks = mesh_looks(mesh, {n for n, _ in groups}, bool(placed.any()), path, error)
    for one, has in groups:
        look = looks[one]
        if look.picture is None and not has:
            continue
        chosen = rows[(number == one) & ((placed == has) | (look.picture is None))]
        if len(chosen):
            yield _part(mesh, chosen, look, look.picture is not None and has)


def _part(mesh: PolygonMesh, rows: NDArray[np.int64], look: Look, pictured: bool) -> MeshPart:
    corners, uv = mesh.corners[rows], None
    if pictured:
        # A vertex becomes as many as it has places in the picture.
        key = corners * len(mesh.uv) + mesh.places[rows]
        used, inverse = np.unique(key, return_inverse=True)
        used, place = np.divmod(used, len(mesh.uv))
        corners = inverse.reshape(corners.shape)
        uv = mesh.uv[place] * look.scale + look.offset
    else:
        there = np.zeros(len(mesh.vertices), bool)
        there[corners] = True
        used = np.flatnonzero(there)
        corners = (np.cumsum(there) - 1)[corners]
    color = look.color if mesh.colors is None else mesh.colors[used]
    grey = GREY if color is None else color
    return MeshPart(
        look.name[:80],
        mesh.vertices[used],
        corners.astype(np.int64),
        uv,
        look.picture if pictured else None,
        np.broadcast_to(np.asarray(grey, np.uint8), (len(used), 3)).copy(),
        pictured or color is not None,
        look.opacity if pictured else "opaque",
    )
