"""Walks on quad meshes: loops, flood fills, mirror maps, Laplacians, limit surfaces."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import scipy.sparse as sp


class Connectivity:
    """Neighbours of every vertex, and which edges share a face."""

    def __init__(self, quads: np.ndarray) -> None:
        self.neighbours: dict[int, set[int]] = defaultdict(set)
        self.faces_of: dict[int, list[int]] = defaultdict(list)
        self.quads = quads
        for face, quad in enumerate(quads):
            for a, b in zip(quad, np.roll(quad, -1), strict=True):
                self.neighbours[int(a)].add(int(b))
                self.neighbours[int(b)].add(int(a))
                self.faces_of[int(a)].append(face)

    def loop(self, start: int, second: int) -> list[int]:
        """Vertices of the closed edge loop that begins start → second."""
        path = [start, second]
        while True:
            step = self._straight(path[-2], path[-1])
            if step == start:
                return path
            if step is None or len(path) > 1000:
                raise ValueError(f"edge loop from {start} to {second} does not close")
            path.append(step)

    def _straight(self, before: int, here: int) -> int | None:
        """The edge opposite to before → here at a vertex of four edges."""
        beside = {
            int(corner)
            for face in self.faces_of[here]
            if before in self.quads[face]
            for corner in self.quads[face]
        }
        ahead = [vertex for vertex in self.neighbours[here] if vertex not in beside]
        return ahead[0] if len(ahead) == 1 else None

    def flood(self, start: int, wall: set[int]) -> set[int]:
        """Vertices reachable from `start` without stepping over `wall`, wall included."""
        seen, front = {start}, [start]
        while front:
            for vertex in self.neighbours[front.pop()]:
                if vertex not in seen:
                    seen.add(vertex)
                    if vertex not in wall:
                        front.append(vertex)
        return seen


def mirror_map(vertices: np.ndarray, tolerance_m: float = 2e-4) -> np.ndarray:
    """(vertex,) index of each vertex's partner across x = 0."""
    from scipy.spatial import KDTree

    distance, partner = map(np.asarray, KDTree(vertices).query(vertices * [-1, 1, 1]))
    if distance.max() > tolerance_m or not np.array_equal(
        partner[partner], np.arange(len(vertices))
    ):
        raise ValueError(f"no exact mirror map: off by {distance.max() * 1000:.2f} mm")
    return partner


def mirrored(field: np.ndarray, mirror: np.ndarray) -> np.ndarray:
    """Positions or displacements (..., vertex, 3) seen in the mirror."""
    return field[..., mirror, :] * np.array([-1.0, 1.0, 1.0])


def symmetrised(field: np.ndarray, mirror: np.ndarray) -> np.ndarray:
    return (field + mirrored(field, mirror)) / 2


def adjacency(quads: np.ndarray, count: int) -> sp.csr_matrix:
    rows = quads.ravel()
    columns = np.roll(quads, -1, axis=1).ravel()
    matrix = sp.csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    matrix = ((matrix + matrix.T) > 0).astype(float)
    matrix.setdiag(0)
    matrix.eliminate_zeros()
    return matrix.tocsr()


def limit_stencil(quads: np.ndarray, count: int) -> sp.csr_matrix:
    """(vertex, vertex): where Catmull-Clark subdivision ends for the original vertices.

    Inner vertex of n edges: (n² v + 4 Σ edge ends + Σ face diagonals) / (n (n + 5)) with
    every point taken one subdivision on; a rim vertex follows the cubic spline of its rim.
    """
    edges: dict[tuple[int, int], list[int]] = defaultdict(list)
    for face, quad in enumerate(quads):
        for a, b in zip(quad, np.roll(quad, -1), strict=True):
            edges[min(a, b), max(a, b)].append(face)
    around: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for edge in edges:
        around[edge[0]].append(edge)
        around[edge[1]].append(edge)
    faces_of: dict[int, list[int]] = defaultdict(list)
    for face, quad in enumerate(quads):
        for vertex in quad:
            faces_of[int(vertex)].append(face)
    rows, columns, values = [], [], []

    def add(row: int, column: int, value: float) -> None:
        rows.append(row)
        columns.append(int(column))
        values.append(value)

    for vertex in range(count):
        mine = around[vertex]
        rim = [edge for edge in mine if len(edges[edge]) == 1]
        if rim:
            add(vertex, vertex, 4 / 6)
            for edge in rim:
                add(vertex, sum(edge) - vertex, 1 / 6)
            continue
        n = len(mine)
        total = n * (n + 5)
        # One subdivision on: v1 = (F + 2E + (n - 3) v) / n, e1 = (a + b + f + f') / 4.
        face_share = n * n / total / n / n
        add(vertex, vertex, n * n / total * (n - 3) / n)
        for edge in mine:
            other = sum(edge) - vertex
            mid_share = n * n / total * 2 / n / n
            add(vertex, vertex, mid_share / 2 + 4 / total / 4)
            add(vertex, other, mid_share / 2 + 4 / total / 4)
        for face in faces_of[vertex]:
            # Each face centre enters v1 once, two edge points (a quarter each) and itself.
            share = face_share + 2 * 4 / total / 4 + 1 / total
            for corner in quads[face]:
                add(vertex, corner, share / 4)
    return sp.csr_matrix((values, (rows, columns)), shape=(count, count))


class SmoothSpread:
    """Carry displacements of a few handle vertices smoothly to the skin around them.

    Minimises |L² d|² + α|L d|² (L: uniform Laplacian) with the handles given and everything
    outside `free` fixed.
    """

    def __init__(
        self, quads: np.ndarray, count: int, handles: np.ndarray, free: np.ndarray, alpha: float
    ) -> None:
        from scipy.sparse.linalg import splu

        links = adjacency(quads, count)
        degree = np.asarray(links.sum(1)).ravel()
        degree[degree == 0] = 1
        walk = sp.identity(count) - sp.diags(1 / degree) @ links
        energy = (walk.T @ walk + alpha * walk.T @ sp.identity(count)).tocsr()
        energy = (energy + energy.T) / 2
        self.handles = np.asarray(handles)
        is_free = np.zeros(count, bool)
        is_free[free] = True
        is_free[self.handles] = False
        self.free = np.flatnonzero(is_free)
        self.count = count
        self._solve = splu(energy[self.free][:, self.free].tocsc()).solve
        self._to_handles = energy[self.free][:, self.handles]

    def __call__(self, displacement: np.ndarray) -> np.ndarray:
        """(vertex, 3) from the displacement (handle, 3) of the handles."""
        spread = np.zeros((self.count, 3))
        spread[self.handles] = displacement
        spread[self.free] = self._solve(-(self._to_handles @ displacement))
        return spread
