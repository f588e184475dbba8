"""Vertex normals, and linear vertex colours, for renderers and exporters."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import FloatArray
from elocute.head.model import HeadModel


def vertex_normals(points: FloatArray, triangles: NDArray[np.integer]) -> FloatArray:
    """Normals of vertices: mean of the triangles around them, weighted by area.

    Parameters
    ----------
    points : (vertex, 3)
        Vertices, in any unit.
    triangles : (triangle, 3) of int
        Vertex indices.

    Returns
    -------
    (vertex, 3) float32
        Unit vectors; zero for a vertex without area.
    """
    return _unit(_gather(_face_normals(points, triangles), triangles, len(points)))


def morphed_normals(
    points: FloatArray, triangles: NDArray[np.integer], shapes: FloatArray
) -> Iterator[tuple[NDArray[np.intp], FloatArray]]:
    """How normals change as shapes are added to a mesh; only triangles that move are computed.

    Parameters
    ----------
    points : (vertex, 3)
        Vertices, in any unit.
    triangles : (triangle, 3) of int
        Vertex indices.
    shapes : (shape, vertex, 3)
        Displacements, in the same unit.

    Yields
    ------
    vertices : (place,) of int
        The vertices at triangles that this shape moves.
    change : (place, 3) float32
        Their new unit normals minus the old ones.
    """
    faces = _face_normals(points, triangles)
    sums = _gather(faces, triangles, len(points))
    normals = _unit(sums)
    t0, t1, t2 = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    for shape in shapes:
        moved = moved_vertices(shape)
        touched = np.flatnonzero(moved[t0] | moved[t1] | moved[t2])
        corners = triangles[touched]
        change = _face_normals(points + shape, corners) - faces[:, touched]
        near = np.zeros(len(points), bool)
        near[corners] = True
        vertices = np.flatnonzero(near)
        total = sums[:, vertices] + _gather(change, corners, len(points))[:, vertices]
        yield vertices, _unit(total) - normals[vertices]


def moved_vertices(shape: FloatArray) -> NDArray[np.bool_]:
    """Which vertices (vertex,) a shape (vertex, 3) of displacements moves.

    This is faster than `any` over short rows.
    """
    return (shape[:, 0] != 0) | (shape[:, 1] != 0) | (shape[:, 2] != 0)


def _face_normals(points: FloatArray, triangles: NDArray[np.integer]) -> FloatArray:
    """(3, triangle) twice the area along the normal; long rows go several times faster."""
    corners = np.ascontiguousarray(triangles.T)
    x, y, z = (np.take(row, corners) for row in np.ascontiguousarray(points.T))
    ux, uy, uz, vx, vy, vz = (row[k] - row[0] for k in (1, 2) for row in (x, y, z))
    return np.stack([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx])


def _gather(faces: FloatArray, triangles: NDArray[np.integer], count: int) -> NDArray[np.float64]:
    """(3, vertex) sums of what faces (3, triangle) give to each of their three vertices."""
    corners = triangles.ravel().astype(np.intp)
    sums = [np.bincount(corners, np.repeat(row, 3), count) for row in faces]
    return np.stack(sums).astype(np.float64, copy=False)


def _unit(sums: NDArray[np.float64]) -> FloatArray:
    """(vertex, 3) of (3, vertex)."""
    lengths = np.sqrt(np.einsum("cv,cv->v", sums, sums))
    return np.ascontiguousarray((sums / np.maximum(lengths, 1e-20)).T, np.float32)


def linear_colors(head: HeadModel) -> FloatArray:
    """Colours of a head in linear light, 0 to 1, with the baked occlusion in them.

    Returns
    -------
    (vertex, 3) float32
    """
    srgb = head.vertex_color.astype(np.float32) / 255
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return (linear * head.occlusion[:, None]).astype(np.float32)
