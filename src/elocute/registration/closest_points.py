"""Closest points on triangle meshes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array, IntArray
from elocute.one_line_repr import one_line

SAMPLE_M = 0.004
"""Spacing of the samples by which a triangle of a coarse mesh is found."""
SAMPLES_MAX = 12  # along an edge: beyond, triangles are found by their nearest parts less surely


@dataclass(frozen=True, eq=False)
class ClosestPoints:
    """The point of a mesh closest to each query point.

    triangle: (query,) index. bary: (query, 3) barycentric coordinates in it. points: (query, 3) m.
    squared: (query,) m², squared distance; infinite where none is within reach.
    """

    triangle: NDArray[np.intp]
    bary: Float64Array
    points: Float64Array
    squared: Float64Array

    __repr__ = one_line


def closest_on_triangles(
    query: Float64Array, a: Float64Array, b: Float64Array, c: Float64Array
) -> Float64Array:
    """(query, 3) barycentric coordinates of the point of one triangle closest to each query point.

    All are (query, 3), the points and the corners of their triangles. Ericson, Real-Time Collision
    Detection (2005), 5.1.5: inside by the plane, else the closest of three edges.
    """
    ab, ac, ap = b - a, c - a, query - a
    d00, d01, d11 = _dot(ab, ab), _dot(ab, ac), _dot(ac, ac)
    d20, d21 = _dot(ap, ab), _dot(ap, ac)
    determinant = np.maximum(d00 * d11 - d01 * d01, 1e-300)
    v = (d11 * d20 - d01 * d21) / determinant
    w = (d00 * d21 - d01 * d20) / determinant
    bary = np.stack([1 - v - w, v, w], axis=1)
    outside = np.flatnonzero((bary < 0).any(axis=1))
    if len(outside):
        bary[outside] = _on_edges(query[outside], a[outside], b[outside], c[outside])
    return bary


def _on_edges(
    query: Float64Array, a: Float64Array, b: Float64Array, c: Float64Array
) -> Float64Array:
    corners = (a, b, c)
    best = np.full(len(query), np.inf)
    bary = np.zeros((len(query), 3))
    for first in range(3):
        second = (first + 1) % 3
        start, edge = corners[first], corners[second] - corners[first]
        along = _dot(query - start, edge) / np.maximum(_dot(edge, edge), 1e-300)
        along = np.clip(along, 0, 1)
        left = query - start - along[:, None] * edge
        squared = _dot(left, left)
        closer = squared < best
        best[closer] = squared[closer]
        bary[closer] = 0
        bary[closer, first] = 1 - along[closer]
        bary[closer, second] = along[closer]
    return bary


def _dot(a: Float64Array, b: Float64Array) -> Float64Array:
    return np.einsum("ij,ij->i", a, b)


@dataclass(frozen=True, eq=False)
class DenseMesh:
    """A dense mesh (a scan) of points (vertex, 3) m, each part of one of triangles (triangle, 3).

    The closest triangle is one around the closest vertex.
    """

    points: Float64Array
    triangles: IntArray

    __repr__ = one_line

    @cached_property
    def tree(self) -> Any:
        from scipy.spatial import KDTree

        return KDTree(self.points, balanced_tree=False, compact_nodes=False, leafsize=16)

    @cached_property
    def _fans(self) -> NDArray[np.intp]:
        """(vertex, 8) triangles around each vertex; short fans repeat their first."""
        corners = self.triangles.ravel()
        order = np.argsort(corners, kind="stable")
        counts = np.bincount(corners, minlength=len(self.points))
        starts = np.cumsum(counts) - counts
        step = np.arange(8)
        step = np.where(step < counts[:, None], step, 0)
        return (order // 3)[np.minimum(starts[:, None] + step, len(order) - 1)]

    def closest(self, query: Float64Array, reach_m: float = np.inf) -> ClosestPoints:
        """The closest points to query (query, 3) m; beyond reach_m their distance is infinite."""
        _, vertex = self.tree.query(query, distance_upper_bound=reach_m)
        reached = vertex < len(self.points)
        vertex = np.where(reached, vertex, 0)
        fans = self._fans[vertex]
        best = ClosestPoints(
            fans[:, 0],
            np.zeros((len(query), 3)),
            np.zeros((len(query), 3)),
            np.full(len(query), np.inf),
        )
        for column in range(fans.shape[1]):
            # A fan that has ended repeats its first triangle: nothing new there.
            rows = np.flatnonzero(reached & ((fans[:, column] != fans[:, 0]) | (column == 0)))
            _improve(best, rows, query[rows], fans[rows, column], self.points, self.triangles)
        return best


@dataclass(frozen=True, eq=False)
class TriangleSamples:
    """Samples on the triangles of a coarse mesh, by which the closest triangle is found.

    triangle: (sample,) index. bary: (sample, 3) barycentric coordinates in it. Made once for a
    topology, valid for all its shapes.
    """

    triangle: NDArray[np.intp]
    bary: Float64Array

    __repr__ = one_line

    def points(self, vertices: Float64Array, triangles: IntArray) -> Float64Array:
        corners = vertices[triangles[self.triangle]]
        return np.einsum("sc,sca->sa", self.bary, corners)


def sample_triangles(
    vertices: Float64Array, triangles: IntArray, spacing_m: float = SAMPLE_M
) -> TriangleSamples:
    """Samples no further apart than about spacing_m, at least one per triangle."""
    corners = vertices[triangles]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.clip(np.ceil(edges / spacing_m), 1, SAMPLES_MAX).astype(int)
    triangle, bary = [], []
    for count in np.unique(parts):
        rows = np.flatnonzero(parts == count)
        inner = _inner_samples(int(count))
        triangle.append(np.repeat(rows, len(inner)))
        bary.append(np.tile(inner, (len(rows), 1)))
    return TriangleSamples(np.concatenate(triangle), np.concatenate(bary))


def _inner_samples(count: int) -> Float64Array:
    """(sample, 3) centres of the count² small triangles into which a triangle divides."""
    samples = []
    for i in range(count):
        for j in range(count - i):
            samples.append(((i + 1 / 3) / count, (j + 1 / 3) / count))
            if j < count - i - 1:
                samples.append(((i + 2 / 3) / count, (j + 2 / 3) / count))
    uv = np.array(samples)
    return np.column_stack([1 - uv.sum(axis=1), uv])


@dataclass(frozen=True, eq=False)
class CoarseMesh:
    """A mesh with large triangles (a template), searched by samples on them; vertices are in m."""

    vertices: Float64Array
    triangles: IntArray
    triangle_samples: TriangleSamples

    __repr__ = one_line

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import KDTree

        samples = self.triangle_samples.points(self.vertices, self.triangles)
        return KDTree(samples, balanced_tree=False, compact_nodes=False, leafsize=16)

    def closest(self, query: Float64Array, reach_m: float = np.inf, near: int = 2) -> ClosestPoints:
        """The closest points to query (query, 3) m, among the triangles of `near` samples."""
        _, sample = self._tree.query(query, k=near, distance_upper_bound=reach_m)
        sample = sample.reshape(len(query), near)
        best = ClosestPoints(
            np.zeros(len(query), np.intp),
            np.zeros((len(query), 3)),
            np.zeros((len(query), 3)),
            np.full(len(query), np.inf),
        )
        count = len(self.triangle_samples.triangle)
        before = np.full(len(query), -1)
        for column in range(near):
            triangle = self.triangle_samples.triangle[np.minimum(sample[:, column], count - 1)]
            rows = np.flatnonzero((sample[:, column] < count) & (triangle != before))
            before = triangle
            _improve(best, rows, query[rows], triangle[rows], self.vertices, self.triangles)
        return best


def _improve(
    best: ClosestPoints,
    rows: NDArray[np.intp],
    query: Float64Array,
    triangle: NDArray[np.intp],
    vertices: Float64Array,
    triangles: IntArray,
) -> None:
    """Take a triangle for rows where it is closer than what was found before."""
    a, b, c = (vertices[triangles[triangle, corner]] for corner in range(3))
    bary = closest_on_triangles(query, a, b, c)
    points = bary[:, :1] * a + bary[:, 1:2] * b + bary[:, 2:] * c
    left = query - points
    squared = _dot(left, left)
    closer = squared < best.squared[rows]
    chosen = rows[closer]
    best.triangle[chosen] = triangle[closer]
    best.bary[chosen], best.points[chosen] = bary[closer], points[closer]
    best.squared[chosen] = squared[closer]
