"""Where a shirt lies on its picture: round the neck from the back, down from the band's edge."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import spsolve

from recipes.head.topology import adjacency
from recipes.looks.cuts import Cut


def texture(points, quads, cut: Cut, band: list[np.ndarray], rim) -> tuple[np.ndarray, np.ndarray]:
    """(texcoord, 2) and (face, 4): round the neck from the back, and down from the band's edge."""
    rings, columns = len(band), len(band[0])
    band_faces = rings * columns
    count = len(points)
    turn, down = np.zeros(count), np.zeros(count)
    start = int(points[:columns, 2].argmin())
    share = ((np.arange(columns) - start) % columns) / columns
    section = np.r_[0, np.cumsum(np.linalg.norm(np.diff(band, axis=0), axis=2).mean(1))]
    section = section / (section[-1] + 0.0035)
    for ring in range(rings):
        own = slice(ring * columns, (ring + 1) * columns)
        turn[own], down[own] = share, cut.band_share * section[ring]
    body = quads[band_faces:]
    angle = _carried_angle(points, body, rim, 2 * np.pi * share)
    below = np.arange(rings * columns, count)
    turn[below] = angle[below] / (2 * np.pi) % 1
    far = _distances(points, body, rim)
    down[below] = cut.band_share + (1 - cut.band_share) * np.sqrt(far[below] / far[below].max())
    turn[rim] = share
    corner = turn[quads]
    # Faces over the seam at the back count on beyond one.
    wraps = np.ptp(corner, axis=1) > 0.5
    corner = np.where(wraps[:, None] & (corner < 0.5), corner + 1, corner)
    texel = np.stack([0.02 + 0.94 * corner, 1 - (0.005 + 0.99 * down[quads])], -1)
    uv, uv_quads = np.unique(texel.reshape(-1, 2).round(6), axis=0, return_inverse=True)
    return np.clip(uv, 0, 1), uv_quads.reshape(-1, 4)


def _carried_angle(points, quads, rim, angle) -> np.ndarray:
    """The angle of the rim carried over the cloth (harmonic)."""
    count = len(points)
    links = adjacency(quads, count)
    degree = np.asarray(links.sum(1)).ravel()
    used = np.flatnonzero(degree > 0)
    free = np.setdiff1d(used, rim)
    laplace = (sp.diags(degree) - links).tocsr()
    given = np.stack([np.cos(angle), np.sin(angle)], 1)
    solved = np.asarray(spsolve(laplace[free][:, free].tocsc(), -(laplace[free][:, rim] @ given)))
    whole = np.zeros(count)
    whole[free] = np.arctan2(solved[:, 1], solved[:, 0])
    whole[rim] = angle
    return whole


def _distances(points, quads, rim) -> np.ndarray:
    pairs = np.stack([quads, np.roll(quads, -1, 1)], -1).reshape(-1, 2)
    diagonals = np.vstack([quads[:, [0, 2]], quads[:, [1, 3]]])
    pairs = np.vstack([pairs, diagonals])
    length = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    graph = sp.coo_matrix((length, tuple(pairs.T)), shape=(len(points),) * 2).tocsr()
    graph = graph.maximum(graph.T)
    far = np.asarray(dijkstra(graph, directed=False, indices=rim, min_only=True))
    return np.where(np.isfinite(far), far, 0)
