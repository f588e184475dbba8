"""Scans from and to mesh files.

Where colours come from a picture, triangles are cut until points carry what the picture shows.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.corpus.length_units import UNITS
from elocute.errors import CaptureError
from elocute.files.atomic import write_atomically
from elocute.meshes.mesh_file import MeshPart
from elocute.meshes.parts import SUFFIXES, read_mesh_parts
from elocute.registration.scan import Scan, welded

FILE_MAX_BYTES = 1_000_000_000
FINE_POINTS, CUTS_MAX = 200_000, 3
"""A scan is cut finer up to so many points, as many as its picture has pixels, or so often."""
UNLIKE, MOTTLED_SHARE, MOTTLED_CUTS = 24, 0.1, 2
"""Where materials of colours so far from their mean meet at so many points, triangles are cut so
often that each has points of its own."""
EDGE = 1e-4
"""So far beyond a picture's edge, a place means the edge and not what repeats there."""


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

    Warns
    -----
    ElocuteWarning
        For materials and pictures that are named but not there.
    """
    path, scale = Path(path), unit_m(unit)
    if path.suffix.lower() not in SUFFIXES:
        raise CaptureError.about(
            path, found=f"suffix {path.suffix!r}", allowed=f"{' '.join(SUFFIXES)} up to 1 GB"
        )
    parts = read_mesh_parts(path, max_bytes=FILE_MAX_BYTES, error=CaptureError, finite=False)
    points, faces, colors = _one_mesh(parts)
    pictured = any(part.picture is not None for part in parts)
    if len(parts) > 1 or pictured or path.suffix.lower() not in (".obj", ".ply"):
        if colors is not None and len(parts) > 1 and _is_mottled(points, colors):
            points, faces, colors = _one_mesh(parts, MOTTLED_CUTS)
        points, faces, colors = welded(points, faces, colors)
    return Scan(str(path), scale * points, faces.astype(np.int32), colors, scale)


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


def _one_mesh(
    parts: tuple[MeshPart, ...], cuts: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.uint8] | None]:
    """Points, triangles and colours of all parts; no colours where nothing says one."""
    count = sum(len(part.vertices) for part in parts)
    meshes = [_pictured(part, max(count, 1), cuts) for part in parts]
    starts = np.cumsum([0, *(len(points) for points, _, _ in meshes)])
    faces = [mesh[1] + start for mesh, start in zip(meshes, starts, strict=False)]
    said = any(part.coloured for part in parts)
    colors = np.concatenate([mesh[2] for mesh in meshes]) if said else None
    return np.concatenate([mesh[0] for mesh in meshes]), np.concatenate(faces), colors


def _pictured(
    part: MeshPart, count: int, cuts: int
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.uint8]]:
    """A part cut fine enough for its picture, with the picture's colours at its points."""
    if part.picture is None or part.uv is None:
        corners, faces = np.hstack([part.vertices, part.colors.astype(np.float64)]), part.triangles
        for _ in range(cuts):
            corners, faces = _cut(corners, faces)
        return corners[:, :3], faces, corners[:, 3:].astype(np.uint8)
    from PIL.Image import Resampling

    corners, faces = np.hstack([part.vertices, part.uv]), part.triangles
    most = min(FINE_POINTS, part.picture.width * part.picture.height)
    for done in range(CUTS_MAX):
        if done >= cuts and 4 * count >= most:
            break
        corners, faces = _cut(corners, faces)
        count *= 4
    # A pixel for each point, so that stubble becomes a shadow and no speckle.
    shrink = max(1.0, (part.picture.width * part.picture.height / max(count, 1)) ** 0.5)
    size = (max(round(part.picture.width / shrink), 1), max(round(part.picture.height / shrink), 1))
    pixels = np.asarray(part.picture.convert("RGB").resize(size, Resampling.BOX))
    height, width = pixels.shape[:2]
    places = _in_picture(corners[:, 3:], faces) * [width, height]
    column = places[:, 0].astype(np.intp).clip(0, width - 1)
    row = (height - places[:, 1]).astype(np.intp).clip(0, height - 1)
    return corners[:, :3], faces, pixels[row, column]


def _is_mottled(points: NDArray[np.float64], colors: NDArray[np.uint8]) -> bool:
    """Whether parts of unlike colours meet at many points, and may be cut finer."""
    _, place, mean = welded(points, np.arange(len(points)), colors)
    assert mean is not None
    apart = np.abs(colors.astype(np.int16) - mean[place]).max(axis=1) > UNLIKE
    return bool(apart.mean() > MOTTLED_SHARE) and len(points) << 2 * MOTTLED_CUTS <= FINE_POINTS


def _in_picture(uv: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Places (point, 2), 0 to 1, in a picture that repeats beyond its edges.

    At an edge it is the side that the triangles are on which counts: 1 is not 0 again.
    """
    tile = np.zeros_like(uv)
    tile[faces] = np.floor(uv[faces].mean(axis=1, keepdims=True))
    within = uv - tile
    inside = (within > -EDGE) & (within < 1 + EDGE)
    return np.where(inside, within.clip(0, 1), np.mod(within, 1))


def _cut(
    corners: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Rows with those halfway along every edge, and each triangle cut into four."""
    count = len(corners)
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1), axis=-1)
    edges, number = np.unique(ends[..., 0] * count + ends[..., 1], return_inverse=True)
    middle = (corners[edges // count] + corners[edges % count]) / 2
    (a, b, c), (ab, bc, ca) = faces.T, count + number.reshape(faces.shape).T
    cut = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1)
    return np.concatenate([corners, middle]), cut.reshape(-1, 3).astype(np.int64)
