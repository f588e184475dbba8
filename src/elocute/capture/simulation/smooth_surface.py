"""A smooth surface through the vertices of a template, for simulated scans."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.head.normals import vertex_normals
from elocute.one_line_repr import one_line

ROUNDNESS = 0.75  # Boubekeur and Alexa's own choice


@dataclass(frozen=True, eq=False)
class Subdivision:
    """Triangles cut into parts², the same for every shape of a mesh.

    Attributes
    ----------
    parent
        (fine point,) the triangle it lies on.
    bary
        (fine point, 3) barycentric coordinates in it.
    triangles
        (fine triangle, 3) into fine points.
    """

    parent: NDArray[np.intp]
    bary: Float64Array
    triangles: NDArray[np.int32]

    __repr__ = one_line


def subdivide_triangles(triangles: NDArray[np.integer], parts: int) -> Subdivision:
    """Cut every triangle into parts² similar ones; points on shared edges are kept twice."""
    places = [(i, j) for i in range(parts + 1) for j in range(parts + 1 - i)]
    index = {place: number for number, place in enumerate(places)}
    small = []
    for i, j in places:
        if i + j < parts:
            small.append((index[i, j], index[i + 1, j], index[i, j + 1]))
        if i + j < parts - 1:
            small.append((index[i + 1, j], index[i + 1, j + 1], index[i, j + 1]))
    uv = np.array(places) / parts
    bary = np.column_stack([1 - uv.sum(axis=1), uv])
    count = len(triangles)
    fine = np.array(small)[None] + len(places) * np.arange(count)[:, None, None]
    return Subdivision(
        np.repeat(np.arange(count), len(places)),
        np.tile(bary, (count, 1)),
        fine.reshape(-1, 3).astype(np.int32),
    )


def phong_tessellation(
    vertices: NDArray[np.floating], triangles: NDArray[np.integer], where: Subdivision
) -> Float64Array:
    """(fine point, 3) m on the rounded surface through vertices (vertex, 3) m.

    A point of the flat triangle is drawn towards its projections onto the tangent planes at the
    three corners; corners stay where they are (Phong tessellation, Boubekeur and Alexa 2008).
    """
    vertices = vertices.astype(np.float64)
    normals = vertex_normals(vertices, triangles).astype(np.float64)
    corners = triangles[where.parent]
    flat = np.einsum("pc,pca->pa", where.bary, vertices[corners])
    rounded = np.zeros_like(flat)
    for corner in range(3):
        vertex = corners[:, corner]
        above = np.einsum("pa,pa->p", flat - vertices[vertex], normals[vertex])
        rounded += where.bary[:, corner, None] * (flat - above[:, None] * normals[vertex])
    return (1 - ROUNDNESS) * flat + ROUNDNESS * rounded
