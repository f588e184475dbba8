"""Scans from and to mesh files: binary .ply at the speed of the disk, the rest by trimesh.

Where colours come from a picture, triangles are cut until points carry what the picture shows.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.capture.scans.scan import Scan
from elocute.corpus.length_units import UNITS
from elocute.errors import CaptureError
from elocute.files.atomic import write_atomically
from elocute.files.mesh_part import MeshPart
from elocute.files.mesh_parts import SUFFIXES, read_mesh_parts
from elocute.files.meshes import read_mesh_file
from elocute.files.reading import open_regular

FILE_MAX_BYTES = 1_000_000_000
HEADER_MAX_BYTES = 16_384
FINE_POINTS, CUTS_MAX = 200_000, 3
"""A scan is cut finer up to so many points, as many as its picture has pixels, or so often."""
_COUNT = re.compile(r"[0-9]{1,10}", re.ASCII)
_TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "<i2",
    "int16": "<i2",
    "ushort": "<u2",
    "uint16": "<u2",
    "int": "<i4",
    "int32": "<i4",
    "uint": "<u4",
    "uint32": "<u4",
    "float": "<f4",
    "float32": "<f4",
    "double": "<f8",
    "float64": "<f8",
}


def read_scan(path: str | Path, unit: str = "m") -> Scan:
    """The scan in a file as it is, in metres; `checked_scan` says whether it is usable.

    Parameters
    ----------
    path
        A .ply, .obj, .stl, .glb, .gltf, .vrm or .fbx up to 1 GB. Colours come from the vertices, a
        texture or the materials.
    unit
        Of the numbers in the file: m, mm, cm, dm or inch.

    Raises
    ------
    CaptureError
        For a file that is missing, too large or no mesh, and for an unknown unit.
    """
    path, scale = Path(path), unit_m(unit)
    if path.suffix.lower() not in SUFFIXES:
        raise CaptureError.about(
            path, found=f"suffix {path.suffix!r}", allowed=f"{' '.join(SUFFIXES)} up to 1 GB"
        )
    points, faces, colors = _read_plain_ply(path) or _read_by_trimesh(path)
    if not len(points) or not len(faces):
        raise CaptureError.about(
            path, found=f"{len(points)} points, {len(faces)} triangles", allowed="a mesh"
        )
    if faces.min() < 0 or faces.max() >= len(points):
        raise CaptureError.about(path, found=f"triangles that point past {len(points)} points")
    return Scan(str(path), scale * points.astype(np.float64), faces.astype(np.int32), colors, scale)


def unit_m(unit: str) -> float:
    """Metres in a unit. Raises CaptureError for an unknown one."""
    known = {"m": 1.0, **UNITS}
    if unit not in known:
        raise CaptureError.about(f"unit {unit[:60]!r}", found="unknown", allowed=", ".join(known))
    return known[unit]


def write_scan(
    path: str | Path,
    points: NDArray[np.floating],
    triangles: NDArray[np.integer],
    colors: NDArray[np.uint8] | None = None,
) -> None:
    """A binary .ply of points (point, 3), in whatever unit they are. Raises OutputError."""
    fields: list[Any] = [("xyz", "<f4", 3)]
    coloured = ""
    if colors is not None:
        fields.append(("rgb", "u1", 3))
        coloured = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    vertices = np.empty(len(points), np.dtype(fields))
    vertices["xyz"] = points
    if colors is not None:
        vertices["rgb"] = colors
    faces = np.zeros(len(triangles), np.dtype([("n", "u1"), ("abc", "<i4", 3)]))
    faces["n"], faces["abc"] = 3, triangles
    opening = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
        f"property float x\nproperty float y\nproperty float z\n{coloured}"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    with write_atomically(path) as draft, draft.open("wb") as file:
        file.write(opening.encode())
        file.write(vertices.tobytes())
        file.write(faces.tobytes())


_Parts = tuple[NDArray[np.floating], NDArray[np.integer], NDArray[np.uint8] | None]


def _read_plain_ply(path: Path) -> _Parts | None:
    """Little-endian vertices and triangles read in two gulps, or None for any other layout."""
    if path.suffix.lower() != ".ply":
        return None
    with open_regular(path, max_bytes=FILE_MAX_BYTES, allowed="a mesh", error=CaptureError) as file:
        header = file.read(HEADER_MAX_BYTES)
        end = header.find(b"end_header")
        newline = header.find(b"\n", end)
        lines = header[: max(end, 0)].decode("ascii", "replace").split("\n")
        layout = _layout(lines) if end > 0 and newline > 0 else None
        if layout is None:
            return None
        vertex_type, vertex_count, face_type, face_count = layout
        wanted = vertex_count * vertex_type.itemsize + face_count * face_type.itemsize
        if os.fstat(file.fileno()).st_size < newline + 1 + wanted:
            raise CaptureError.about(
                path, found="shorter than its header says", allowed="a whole mesh"
            )
        file.seek(newline + 1)
        vertices = np.frombuffer(file.read(vertex_count * vertex_type.itemsize), vertex_type)
        faces = np.frombuffer(file.read(face_count * face_type.itemsize), face_type)
    if len(faces) and (faces["n"] != 3).any():
        return None
    points = np.stack([vertices[axis] for axis in "xyz"], axis=1)
    colors = None
    if vertex_type.names and {"red", "green", "blue"} <= set(vertex_type.names):
        colors = np.stack([vertices[name] for name in ("red", "green", "blue")], axis=1)
        colors = colors if colors.dtype == np.uint8 else None
    return points, faces["abc"], colors


def _layout(lines: list[str]) -> tuple[np.dtype[Any], int, np.dtype[Any], int] | None:
    """Record types and counts of vertices and faces where the header is of the plain kind."""
    words = [line.split() for line in lines[1:]]
    words = [line for line in words if line and line[0] not in ("comment", "obj_info")]
    if not words or words[0] != ["format", "binary_little_endian", "1.0"]:
        return None
    elements = [line for line in words[1:] if line[0] == "element"]
    if [line[1:2] for line in elements] != [["vertex"], ["face"]] or not all(
        len(line) >= 3 for line in words[1:]
    ):
        return None
    at = words.index(elements[1])
    vertex = [(line[2], _TYPES.get(line[1], "")) for line in words[2:at]]
    face = words[at + 1 :]
    plain = all(kind for _, kind in vertex) and {"x", "y", "z"} <= {name for name, _ in vertex}
    if (
        not plain
        or len(face) != 1
        or len(face[0]) < 4
        or face[0][1:3] not in (["list", "uchar"], ["list", "uint8"])
    ):
        return None
    corner = _TYPES.get(face[0][3], "")
    if corner not in ("<i4", "<u4"):
        return None
    face_type = np.dtype([("n", "u1"), ("abc", corner, 3)])
    names = [name for name, _ in vertex]
    counts = [line[2] for line in elements]
    if len(set(names)) != len(names) or not all(map(_COUNT.fullmatch, counts)):
        return None
    return np.dtype(vertex), int(counts[0]), face_type, int(counts[1])


def _read_by_trimesh(path: Path) -> _Parts:
    if path.suffix.lower() == ".ply":
        parts = read_mesh_file(path, max_bytes=FILE_MAX_BYTES, error=CaptureError, coloured=True)
        points, faces, colors = parts.vertices, parts.triangles, parts.colors
        return _weld_all(points, faces, colors)
    return _weld_all(
        *_one_mesh(read_mesh_parts(path, max_bytes=FILE_MAX_BYTES, error=CaptureError))
    )


def _one_mesh(
    parts: tuple[MeshPart, ...],
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.uint8] | None]:
    """Points, triangles and colours of all parts; no colours where nothing says one."""
    count = sum(len(part.vertices) for part in parts)
    meshes = [_pictured(part, max(count, 1)) for part in parts]
    starts = np.cumsum([0, *(len(points) for points, _, _ in meshes)])
    faces = [mesh[1] + start for mesh, start in zip(meshes, starts, strict=False)]
    said = any(part.coloured for part in parts)
    colors = np.concatenate([mesh[2] for mesh in meshes]) if said else None
    return np.concatenate([mesh[0] for mesh in meshes]), np.concatenate(faces), colors


def _pictured(
    part: MeshPart, count: int
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.uint8]]:
    """A part cut fine enough for its picture, with the picture's colours at its points."""
    if part.picture is None or part.uv is None:
        return part.vertices, part.triangles, part.colors
    from PIL.Image import Resampling
    from trimesh.remesh import subdivide

    corners, faces = np.hstack([part.vertices, part.uv]), part.triangles
    most = min(FINE_POINTS, part.picture.width * part.picture.height)
    for _ in range(CUTS_MAX):
        if 4 * count >= most:
            break
        corners, faces = subdivide(corners, faces)[:2]
        count *= 4
    # A pixel for each point, so that stubble becomes a shadow and no speckle.
    shrink = max(1.0, (part.picture.width * part.picture.height / max(count, 1)) ** 0.5)
    size = (max(round(part.picture.width / shrink), 1), max(round(part.picture.height / shrink), 1))
    pixels = np.asarray(part.picture.convert("RGB").resize(size, Resampling.BOX))
    height, width = pixels.shape[:2]
    # A picture repeats beyond its edges.
    column = (np.mod(corners[:, 3], 1) * width).astype(np.intp).clip(0, width - 1)
    row = (np.mod(1 - corners[:, 4], 1) * height).astype(np.intp).clip(0, height - 1)
    return corners[:, :3], np.asarray(faces, np.int64), pixels[row, column]


def _weld_all(
    points: NDArray[np.floating], faces: NDArray[np.integer], colors: NDArray[np.uint8] | None
) -> _Parts:
    first, place = _same_places(points)
    return points[first], place[faces], None if colors is None else colors[first]


def _same_places(
    points: NDArray[np.floating],
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Points that a seam of the texture doubled, found again by their bytes."""
    raw = np.ascontiguousarray(points, np.float64).view(np.dtype((np.void, 24))).ravel()
    _, first, place = np.unique(raw, return_index=True, return_inverse=True)
    order = np.argsort(first)  # as they come in the file
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[place.ravel()]
