"""A surface to walk on: a mesh made finer, its nearest points, straight ways along it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from elocute.head.normals import vertex_normals


class Skin:
    """A dense surface to walk on."""

    def __init__(self, points: np.ndarray, quads: np.ndarray) -> None:
        for _ in range(2):
            points, quads, _ = subdivided(points, quads)
        self.points, self.quads = points, quads
        self.normals = vertex_normals(points, triangles(quads)).astype(float)
        self.tree = KDTree(points)

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(n, 3) places on the surface and (n, 3) its unit normals there."""
        away, index = map(np.asarray, self.tree.query(points, 6))
        share = 1 / np.maximum(away, 1e-5) ** 2
        share = (share / share.sum(1, keepdims=True))[..., None]
        normal = (self.normals[index] * share).sum(1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        off = ((points[:, None] - self.points[index]) * self.normals[index]).sum(-1, keepdims=True)
        return points - normal * (off * share).sum(1), normal

    def scattered(self, count: int, where: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(count, 3) places evenly at random on the faces of which all corners are chosen."""
        corners = self.points[self.quads[where[self.quads].all(1)]]
        first, second = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
        area = np.linalg.norm(np.cross(first, second), axis=1)
        a, b, c, d = corners[rng.choice(len(corners), count, p=area / area.sum())].swapaxes(0, 1)
        u, v = rng.random((2, count, 1))
        return (1 - u) * ((1 - v) * a + v * d) + u * ((1 - v) * b + v * c)

    def walk(
        self, points: np.ndarray, towards: np.ndarray, length: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Where one comes by keeping on straight along the surface; the direction there."""
        steps = max(1, int(np.ceil(length / 0.001)))
        for _ in range(steps):
            points, normal = self.nearest(points)
            towards = unit(towards - (towards * normal).sum(1, keepdims=True) * normal)
            points = points + towards * (length / steps)
        return self.nearest(points)[0], towards


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def triangles(quads: np.ndarray) -> np.ndarray:
    return np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


@dataclass(frozen=True, eq=False)
class Split:
    """Each quad in four: first the old vertices, then one of each edge, then one of each face."""

    quads: np.ndarray  # (4 face, 4)
    ends: np.ndarray  # (edge, 2) old vertices
    sides: np.ndarray  # (face, 4) edges
    edges: dict[tuple[int, int], int]  # the new vertex of an edge, by its ends, the lower first


def split(quads: np.ndarray, count: int) -> Split:
    """How the quads of a mesh of `count` vertices are divided."""
    edges: dict[tuple[int, int], int] = {}
    for quad in quads.tolist():
        for a, b in zip(quad, quad[1:] + quad[:1], strict=True):
            edges.setdefault((min(a, b), max(a, b)), count + len(edges))
    start = count + len(edges)
    pieces = []
    sides = np.zeros((len(quads), 4), int)
    for face, quad in enumerate(quads.tolist()):
        side = [edges[min(a, b), max(a, b)] for a, b in zip(quad, quad[1:] + quad[:1], strict=True)]
        sides[face] = side
        for k in range(4):
            pieces.append([quad[k], side[k], start + face, side[k - 1]])
    return Split(np.array(pieces), np.array(list(edges)), sides - count, edges)


def subdivided(points: np.ndarray, quads: np.ndarray) -> tuple[np.ndarray, np.ndarray, dict]:
    """Each quad in four, old vertices where they are; the vertex of each edge.

    New ones lie on the cubic through the edge as the normals at its ends say (Bézier), so that
    a round mesh stays round.
    """
    normals = vertex_normals(points, triangles(quads)).astype(float)
    made = split(quads, len(points))
    first, last = made.ends.T
    chord = points[last] - points[first]
    rise = (chord * (normals[last] - normals[first])).sum(1) / 8
    bulge = unit(normals[first] + normals[last]) * rise[:, None]
    middles = (points[first] + points[last]) / 2 + bulge
    centres = middles[made.sides].mean(1) * 2 - points[quads].mean(1)
    centres = 0.5 * centres + 0.5 * middles[made.sides].mean(1)
    return np.vstack([points, middles, centres]), made.quads, made.edges


def subdivided_flat(values: np.ndarray, quads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same of values that are linear between vertices, and its quads."""
    made = split(quads, len(values))
    return np.vstack([values, values[made.ends].mean(1), values[quads].mean(1)]), made.quads
