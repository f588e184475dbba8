"""The parts of a mesh file with their materials: surfaces as other programs dress them.

glTF is read by `gltf_meshes`; other files are parsed by trimesh from bytes that were checked.
Nothing outside the file is opened but an .obj's materials and pictures in its own folder
(`files.meshes`).
"""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError
from elocute.files.draco_gltf import draco_arrays, draco_is_here, has_draco
from elocute.files.gltf_arrays import FOR_EACH_BYTE, MOST_BYTES, GltfArrays, TooMuchError
from elocute.files.gltf_document import SUFFIXES as GLTF_SUFFIXES
from elocute.files.gltf_document import GltfDocument, gltf_document, read_gltf_bytes
from elocute.files.gltf_meshes import gltf_parts
from elocute.files.mesh_part import GREY, MeshPart, drawn_picture
from elocute.files.meshes import SILENT, Folder, check_picture, checked_text
from elocute.files.reading import bytes_text, read_bytes
from elocute.files.unpacked_size import unpacked_limit

SUFFIXES = (".obj", ".ply", ".stl", *GLTF_SUFFIXES)
UNPACKED_MIN_BYTES = 4 * 8192 * 8192
PARTS_MAX = 1000


def read_mesh_parts(
    path: str | Path, *, max_bytes: int, error: type[InputError]
) -> tuple[MeshPart, ...]:
    """Read a mesh with its materials.

    Parameters
    ----------
    path : str or Path
        An .obj, .ply, .stl, .glb, .gltf, .vrm or .fbx.
    max_bytes : int
        Largest size of the file, bytes.
    error : type of InputError
        The class to raise.

    Returns
    -------
    tuple of MeshPart
        One at least, all finite.

    Raises
    ------
    InputError
        Of the class `error`, for a file that is missing, too large, damaged, compressed in a way
        that is not read, not a mesh, or with pictures that unpack to far more than their size.
    MachineError
        For an .fbx where Blender's module is not installed.
    """
    path = Path(path)
    if path.suffix.lower() in GLTF_SUFFIXES:
        document = gltf_document(read_gltf_bytes(path, max_bytes, error), path, error=error)
        return document_parts(document, path, error)
    data = read_bytes(path, max_bytes=max_bytes, allowed="a mesh", error=error)
    kind = path.suffix.lower().removeprefix(".")
    folder = Folder(path, error)
    if kind == "obj":
        data = checked_text(data, path, error)
    try:
        parts = _finite(_parts(data, kind, folder, path, error), path, error)
    except InputError:
        raise
    except Exception as problem:  # trimesh raises whatever its parsers meet
        if folder.refused is not None:
            raise folder.refused from None
        raise _no_mesh(path, error) from problem
    if folder.refused is not None:
        raise folder.refused
    return parts


def document_parts(
    document: GltfDocument, path: Path, error: type[InputError]
) -> tuple[MeshPart, ...]:
    """The parts of a glTF file that was read; path: its name. Raises as `read_mesh_parts`."""
    if has_draco(document):
        if not draco_is_here():
            raise error.about(
                path,
                found="a mesh packed by Draco",
                allowed="vertices as they are",
                remedy="export it without compression, or pip install 'elocute[draco]'",
            )
        arrays = draco_arrays(document, path, error)
    else:
        arrays = GltfArrays(document)
    _check_pictures(document, path, error)
    budget = unpacked_limit(len(document.data), UNPACKED_MIN_BYTES)
    try:
        with np.errstate(all="ignore"):  # what is not finite is refused
            return _finite(gltf_parts(document, arrays, str(path), budget, error), path, error)
    except (InputError, MemoryError):
        raise
    except TooMuchError as problem:
        raise error.about(
            path,
            found="meshes that take more memory than its size allows",
            allowed=f"{bytes_text(MOST_BYTES)}, and {FOR_EACH_BYTE} bytes for each of the file",
        ) from problem
    except Exception as problem:  # records may hold anything where glTF wants something else
        raise _no_mesh(path, error) from problem


def _no_mesh(path: Path, error: type[InputError]) -> InputError:
    allowed = f"a mesh ({' '.join(SUFFIXES)})"
    return error.about(path, found="no mesh that can be read", allowed=allowed)


def _finite(parts: Iterator[MeshPart], path: Path, error: type[InputError]) -> tuple[MeshPart, ...]:
    """The parts, one at least. Raises for vertices that are not finite."""
    found = []
    for part in parts:
        if len(found) == PARTS_MAX:
            raise error.about(path, found="too many parts", allowed=f"up to {PARTS_MAX}")
        if not np.isfinite(part.vertices).all():
            raise error.about(path, found="numbers that are not finite", allowed="a finite mesh")
        found.append(part)
    if not found:
        raise error.about(path, found="no triangles", allowed="a mesh")
    return tuple(found)


def _check_pictures(document: GltfDocument, path: Path, error: type[InputError]) -> None:
    """Raise for a picture that cannot be read, which trimesh would leave out."""
    views = document.records("bufferViews")
    for image in document.records("images")[:PARTS_MAX]:
        view = image.get("bufferView")
        if document.binary is None or not isinstance(view, int) or not 0 <= view < len(views):
            continue
        if views[view].get("buffer") == 0:
            start = int(views[view].get("byteOffset", 0))
            data = document.binary[start : start + int(views[view]["byteLength"])]
            check_picture(bytes(data), path, error)


def _parts(
    data: bytes, kind: str, resolver: Any, path: Path, error: type[InputError]
) -> Iterator[MeshPart]:
    import trimesh

    logging.getLogger("trimesh").addHandler(SILENT)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of vertices without a place in a picture
        scene = trimesh.load_scene(
            io.BytesIO(data), file_type=kind, resolver=resolver, process=False, maintain_order=True
        )
    places = sorted(scene.graph.nodes_geometry)  # which come in no order
    if len(places) > PARTS_MAX:
        raise error.about(path, found=f"{len(places)} parts", allowed=f"up to {PARTS_MAX}")
    budget = unpacked_limit(len(data), UNPACKED_MIN_BYTES)
    for place in places:
        matrix, name = scene.graph[place]
        mesh: Any = scene.geometry[name]
        if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
            continue
        points = trimesh.transform_points(np.asarray(mesh.vertices, np.float64), matrix)
        triangles = np.asarray(mesh.faces, np.int64).reshape(-1, 3)
        if triangles.min() < 0 or triangles.max() >= len(points):
            raise error.about(path, found=f"triangles that point past {len(points)} vertices")
        picture, uv, opacity = _picture(mesh, path, budget, error)
        if picture is not None:
            budget -= 4 * picture.width * picture.height
        colors = _colors(mesh, len(points))
        # An .obj's parts all hold the vertices of the whole.
        used, corners = np.unique(triangles, return_inverse=True)
        material = getattr(getattr(mesh.visual, "material", None), "name", None)
        yield MeshPart(
            str(material if kind == "obj" and material else place)[:80],
            points[used],
            corners.reshape(triangles.shape).astype(np.int64),
            None if uv is None else uv[used],
            picture,
            (np.tile(np.array(GREY, np.uint8), (len(points), 1)) if colors is None else colors)[
                used
            ],
            picture is not None or colors is not None,
            opacity,
        )


def _picture(
    mesh: Any, path: Path, budget: int, error: type[InputError]
) -> tuple[Any, NDArray[np.float64] | None, str]:
    """The picture of a part, the places in it, and how its alpha is meant; (None, None, …)."""
    visual = mesh.visual
    if visual.kind != "texture" or visual.uv is None:
        return None, None, "opaque"
    material = visual.material
    image = getattr(material, "image", None)
    uv = np.asarray(visual.uv, np.float64).reshape(-1, 2)
    if image is None or len(uv) != len(mesh.vertices) or not np.isfinite(uv).all():
        return None, None, "opaque"
    width, height = image.size
    if 4 * width * height > budget:
        raise error.about(
            path,
            found=f"a picture of {width} × {height} pixels",
            allowed=f"pictures up to {bytes_text(max(budget, 0))} unpacked",
        )
    picture, opacity = drawn_picture(image, None)
    return picture, uv, opacity


def _colors(mesh: Any, count: int) -> NDArray[np.uint8] | None:
    """(vertex, 3) sRGB of the vertices, else of the material, else None."""
    visual = mesh.visual
    if visual.kind == "vertex":
        colors = np.asarray(visual.vertex_colors)[:, :3].astype(np.uint8)
        if len(colors) == count:
            return colors
    material = getattr(visual, "material", None)
    if material is not None and material.name and hasattr(material, "diffuse"):
        color = np.asarray(material.diffuse).ravel()[:3]  # of an .obj's material file
    else:
        return None
    return np.tile(color.astype(np.uint8), (count, 1))
