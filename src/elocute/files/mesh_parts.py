"""The parts of a mesh file with their materials: surfaces as other programs dress them.

Parsed by trimesh from bytes that were checked; nothing outside the file is opened but an .obj's
materials and pictures in its own folder (`files.meshes`).
"""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError
from elocute.files.draco_gltf import DRACO, draco_is_here, has_draco, without_draco
from elocute.files.gltf_document import SUFFIXES as GLTF_SUFFIXES
from elocute.files.gltf_document import GltfDocument, gltf_document, read_gltf_bytes
from elocute.files.meshes import SILENT, Folder, Nothing, check_picture, checked_text
from elocute.files.reading import bytes_text, read_bytes
from elocute.files.unpacked_size import unpacked_limit

SUFFIXES = (".obj", ".ply", ".stl", *GLTF_SUFFIXES)
PACKED = (DRACO, "EXT_meshopt_compression", "KHR_meshopt_compression")
PICTURE_SIDE_MAX = 2048
UNPACKED_MIN_BYTES = 4 * 8192 * 8192
PARTS_MAX = 1000
GREY = (190, 190, 190)
JPEG_QUALITY = 92
ALPHA_MODES = {"MASK": "cutout", "BLEND": "blend"}


@dataclass(frozen=True, eq=False)
class MeshPart:
    """Triangles of one material.

    Attributes
    ----------
    name : str
        Of the mesh, or of its material.
    vertices : (vertex, 3) float64
        In the file's unit, where its scene puts them.
    triangles : (face, 3) int64
        Corners.
    uv : (vertex, 2) float64 or None
        Places in the picture, v upwards.
    picture : PIL.Image.Image or None
        The colour, in RGB or RGBA, of at most 2048 pixels a side.
    colors : (vertex, 3) uint8
        sRGB of the vertices, else of the material, else grey; a picture stands in for it.
    coloured : bool
        Whether the file says a colour.
    opacity : str
        "opaque", "cutout" or "blend".
    """

    name: str
    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    uv: NDArray[np.float64] | None
    picture: Any
    colors: NDArray[np.uint8]
    coloured: bool
    opacity: str


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
        data = read_gltf_bytes(path, max_bytes, error)
    else:
        data = read_bytes(path, max_bytes=max_bytes, allowed="a mesh", error=error)
    kind = path.suffix.lower().removeprefix(".")
    folder = Folder(path, error)
    resolver: Any = folder
    if path.suffix.lower() in GLTF_SUFFIXES:
        document = gltf_document(data, path, error=error)
        if _packing(document.record) == [DRACO] and has_draco(document) and draco_is_here():
            data = without_draco(document, path, error)
            document = gltf_document(data, path, error=error)
        _check_packing(document.record, path, error)
        _check_pictures(document, path, error)
        kind, resolver = "gltf" if kind == "gltf" else "glb", Nothing()
    elif kind == "obj":
        data = checked_text(data, path, error)
    try:
        parts = tuple(_parts(data, kind, resolver, path, error))
    except InputError:
        raise
    except Exception as problem:  # trimesh raises whatever its parsers meet
        if folder.refused is not None:
            raise folder.refused from None
        raise error.about(
            path, found="no mesh that can be read", allowed=f"a mesh ({' '.join(SUFFIXES)})"
        ) from problem
    if folder.refused is not None:
        raise folder.refused
    if not parts:
        raise error.about(path, found="no triangles", allowed="a mesh")
    return parts


def _check_packing(record: dict[str, Any], path: Path, error: type[InputError]) -> None:
    """Raise where vertices are packed, which trimesh reads as nothing."""
    packed = _packing(record)
    if packed:
        raise error.about(
            path,
            found=f"a mesh packed by {packed[0]}",
            allowed="vertices as they are",
            remedy="export it without compression"
            + (", or pip install 'elocute[draco]'" if packed == [DRACO] else ""),
        )


def _packing(record: dict[str, Any]) -> list[str]:
    """The ways in which vertices are packed."""
    used = record.get("extensionsRequired", [])
    return [name for name in PACKED if isinstance(used, list) and name in used]


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
        if not np.isfinite(points).all():
            raise error.about(path, found="numbers that are not finite", allowed="a finite mesh")
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
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    mode = getattr(material, "alphaMode", None)
    uv = np.asarray(visual.uv, np.float64).reshape(-1, 2)
    if image is None or len(uv) != len(mesh.vertices) or not np.isfinite(uv).all():
        return None, None, ALPHA_MODES.get(str(mode), "opaque")
    width, height = image.size
    if 4 * width * height > budget:
        raise error.about(
            path,
            found=f"a picture of {width} × {height} pixels",
            allowed=f"pictures up to {bytes_text(max(budget, 0))} unpacked",
        )
    if max(image.size) > PICTURE_SIDE_MAX:
        image.thumbnail((PICTURE_SIDE_MAX, PICTURE_SIDE_MAX))
    clear = "A" in image.getbands() or "transparency" in image.info
    if mode == "OPAQUE" or not clear:
        return image.convert("RGB"), uv, "opaque"
    return image.convert("RGBA"), uv, ALPHA_MODES.get(str(mode), "cutout")


def _colors(mesh: Any, count: int) -> NDArray[np.uint8] | None:
    """(vertex, 3) sRGB of the vertices, else of the material, else None."""
    visual = mesh.visual
    if visual.kind == "vertex":
        colors = np.asarray(visual.vertex_colors)[:, :3].astype(np.uint8)
        if len(colors) == count:
            return colors
    material = getattr(visual, "material", None)
    linear = getattr(material, "baseColorFactor", None)
    if linear is not None:
        shares = np.asarray(linear, np.float64).ravel()[:3] / 255
        color = np.round(255 * np.clip(shares, 0, 1) ** (1 / 2.2))
    elif material is not None and material.name and hasattr(material, "diffuse"):
        color = np.asarray(material.diffuse).ravel()[:3]  # of an .obj's material file
    else:
        return None
    return np.tile(color.astype(np.uint8), (count, 1))


def picture_bytes(picture: Any) -> bytes:
    """A picture as a file: JPEG, or PNG where it has alpha."""
    packed = io.BytesIO()
    if picture.mode == "RGBA":
        picture.save(packed, "PNG")
    else:
        picture.save(packed, "JPEG", quality=JPEG_QUALITY, subsampling=0)
    return packed.getvalue()
