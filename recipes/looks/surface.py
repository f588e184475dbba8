"""A surface to walk on: a mesh made finer, its nearest points, straight ways along it."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from elocute.head.normals import vertex_normals


class Skin:
    """A dense surface to walk on."""

    def __init__(self, points: np.ndarray, quads: np.ndarray) -> None:
        for _ in range(2):
            points, quads, _ = subdivided(points, quads)
        self.points = points
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


def subdivided(points: np.ndarray, quads: np.ndarray) -> tuple[np.ndarray, np.ndarray, dict]:
    """Each quad in four, old vertices where they are; the vertex of each edge.

    New ones lie on the cubic through the edge as the normals at its ends say (Bézier), so that
    a round mesh stays round.
    """
    normals = vertex_normals(points, triangles(quads)).astype(float)
    edges: dict[tuple[int, int], int] = {}
    for quad in quads.tolist():
        for a, b in zip(quad, quad[1:] + quad[:1], strict=True):
            edges.setdefault((min(a, b), max(a, b)), len(points) + len(edges))
    first, last = np.array(list(edges)).T
    chord = points[last] - points[first]
    rise = (chord * (normals[last] - normals[first])).sum(1) / 8
    bulge = unit(normals[first] + normals[last]) * rise[:, None]
    middles = (points[first] + points[last]) / 2 + bulge
    start = len(points) + len(edges)
    pieces = []
    sides = np.zeros((len(quads), 4), int)
    for face, quad in enumerate(quads.tolist()):
        side = [edges[min(a, b), max(a, b)] for a, b in zip(quad, quad[1:] + quad[:1], strict=True)]
        sides[face] = side
        for k in range(4):
            pieces.append([quad[k], side[k], start + face, side[k - 1]])
    own = sides - len(points)
    centres = middles[own].mean(1) * 2 - points[quads].mean(1)
    centres = 0.5 * centres + 0.5 * middles[own].mean(1)
    return np.vstack([points, middles, centres]), np.array(pieces), edges
