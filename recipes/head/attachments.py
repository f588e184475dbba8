"""Parts that ride on the skin: brows, lashes and the closed edge of the bust.

Each vertex is a fixed mixture of skin vertices plus a fixed offset, so a part follows every
identity and expression without bases of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from recipes.head.anatomy import Anatomy

BROW_COLUMNS, BROW_ROWS = 16, 5
LASH_MM = 1.3


@dataclass(frozen=True, eq=False)
class Attachment:
    mixture: sp.csr_matrix  # (vertex, skin vertex), rows sum to one
    offset: np.ndarray  # (vertex, 3) m
    quads: np.ndarray  # skin vertices first, own vertices from skin count on
    mirror: np.ndarray  # (vertex,) own numbering
    shade: np.ndarray  # (vertex,) 0..1, meaning depends on the part


def loose(mixture: sp.csr_matrix, mirror: np.ndarray) -> Attachment:
    """Vertices that are mixtures and no more; their faces belong to another part."""
    count = len(mirror)
    none = np.zeros((0, 4), int)
    return Attachment(mixture, np.zeros((count, 3)), none, mirror, np.ones(count))


def brows(anatomy: Anatomy, skin: np.ndarray, eye: np.ndarray) -> Attachment:
    """Two bands that rise out of the skin along the brow ridge."""
    t = np.linspace(0, 1, BROW_COLUMNS)
    x = 10.5 + 40.0 * t
    middle = 17.6 + 6.2 * np.sin(np.pi * np.clip(t * 0.80 + 0.06, 0, 1)) ** 1.2 - 1.0 * t
    half = np.interp(t, [0, 0.07, 0.16, 0.35, 0.65, 1], [1.0, 2.2, 2.8, 3.0, 2.1, 0.4])
    across = np.linspace(1, -1, BROW_ROWS)
    lift = np.interp(np.abs(across), [0, 0.5, 1], [0.55, 0.45, -0.35])
    rows, offsets = [], []
    for column in range(BROW_COLUMNS):
        for row in range(BROW_ROWS):
            place = np.array([x[column], middle[column] + across[row] * half[column]]) / 1000
            end = 1.0 if 0 < column < BROW_COLUMNS - 1 else 0.0
            mixture, outward = under(anatomy, skin, place + np.array([0, eye[1]]))
            rows.append(mixture)
            offsets.append(outward * (lift[row] * end - 0.3 * (1 - end)) / 1000)
    shade = np.tile(np.abs(across) < 0.9, (BROW_COLUMNS, 1)).astype(float)
    shade[0], shade[1] = 0.15 * shade[0], 0.7 * shade[1]
    return _both_sides(anatomy, rows, np.array(offsets), (BROW_COLUMNS, BROW_ROWS), shade.ravel())


def lashes(anatomy: Anatomy, skin: np.ndarray, eye: np.ndarray) -> Attachment:
    """A short dark fringe along each upper lid."""
    upper, back = anatomy.lid_arc(skin, upper=True), anatomy.lid_middle
    t = np.linspace(0, 1, len(upper))
    length = LASH_MM * np.sin(np.pi * np.clip(t * 0.88 + 0.02, 0, 1)) ** 0.9
    rows, offsets = [], []
    for k, vertex in enumerate(upper):
        nearest = back[np.linalg.norm(skin[back] - skin[vertex], axis=1).argmin()]
        out = skin[vertex] - eye
        direction = np.array([0.25 * out[0] / 0.015, 0.45, 1.0])
        direction /= np.linalg.norm(direction)
        rows += [{int(nearest): 1.0}, {int(vertex): 1.0}, {int(vertex): 1.0}]
        offsets += [np.zeros(3), np.array([0, 0, 0.0002]), direction * length[k] / 1000]
    shade = np.ones(len(rows))
    return _both_sides(anatomy, rows, np.array(offsets), (len(upper), 3), shade)


def bust(anatomy: Anatomy) -> Attachment:
    """Rounds the cut of the neck and closes it."""
    rim = anatomy.rim
    n = len(rim)
    steps = ((0.985, -0.0012), (0.95, -0.0020), (0.6, -0.0020))
    rows, offsets = [], []
    for keep, drop in steps:
        for vertex in rim:
            row = dict.fromkeys(rim.tolist(), (1 - keep) / n)
            row[int(vertex)] += keep
            rows.append(row)
            offsets.append([0, drop, 0])
    rows.append(dict.fromkeys(rim.tolist(), 1 / n))
    offsets.append([0, -0.0020, 0])
    rings = [rim, *(anatomy.skin_count + np.arange(n) + n * k for k in range(len(steps)))]
    quads = []
    for outer, inner in pairwise(rings):
        for k in range(n):
            quads.append([outer[k], outer[(k + 1) % n], inner[(k + 1) % n], inner[k]])
    centre = anatomy.skin_count + n * len(steps)
    for k in range(0, n, 2):
        quads.append([rings[-1][k], rings[-1][(k + 1) % n], rings[-1][(k + 2) % n], centre])
    partner = {int(vertex): k for k, vertex in enumerate(rim)}
    turn = np.array([partner[int(anatomy.skin_mirror[vertex])] for vertex in rim])
    mirror = np.r_[np.concatenate([turn + n * k for k in range(len(steps))]), n * len(steps)]
    faces = np.array(quads)
    if not _rim_runs_outwards(anatomy):
        faces = faces[:, ::-1]
    return Attachment(
        _mixture(rows, anatomy.skin_count), np.array(offsets), faces, mirror, np.ones(len(rows))
    )


def _rim_runs_outwards(anatomy: Anatomy) -> bool:
    """True where the skin face at the rim holds its edge against the rim's direction."""
    a, b = anatomy.rim[:2]
    for quad in anatomy.skin_quads:
        for first, second in zip(quad, np.roll(quad, -1), strict=True):
            if (first, second) == (a, b):
                return False
            if (first, second) == (b, a):
                return True
    raise ValueError("rim edge not found")


def _both_sides(
    anatomy: Anatomy, rows: list, offset: np.ndarray, grid: tuple[int, int], shade: np.ndarray
) -> Attachment:
    """A grid (columns by rows) on the left side and its mirror image."""
    columns, across = grid
    n = len(rows)
    index = np.arange(n).reshape(columns, across)
    quads = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], -1).reshape(
        -1, 4
    )
    other = [
        {int(anatomy.skin_mirror[vertex]): share for vertex, share in row.items()} for row in rows
    ]
    return Attachment(
        _mixture(rows + other, anatomy.skin_count),
        np.vstack([offset, offset * [-1, 1, 1]]),
        np.vstack([quads, quads[:, ::-1] + n]) + anatomy.skin_count,
        np.r_[np.arange(n) + n, np.arange(n)],
        np.r_[shade, shade],
    )


def _mixture(rows: list[dict[int, float]], skin_count: int) -> sp.csr_matrix:
    entries = [(i, j, share) for i, row in enumerate(rows) for j, share in row.items()]
    i, j, share = zip(*entries, strict=True)
    return sp.csr_matrix((share, (i, j)), shape=(len(rows), skin_count))


def under(
    anatomy: Anatomy, skin: np.ndarray, place: np.ndarray
) -> tuple[dict[int, float], np.ndarray]:
    """Barycentric mixture of the foremost skin triangle at (x, y), and its normal."""
    quads = anatomy.skin_quads
    triangles = np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    a, b, c = (skin[triangles[:, k]] for k in range(3))
    v0, v1, v2 = (b - a)[:, :2], (c - a)[:, :2], place - a[:, :2]
    area = v0[:, 0] * v1[:, 1] - v0[:, 1] * v1[:, 0]
    area = np.where(np.abs(area) < 1e-12, np.inf, area)
    u = (v2[:, 0] * v1[:, 1] - v2[:, 1] * v1[:, 0]) / area
    v = (v0[:, 0] * v2[:, 1] - v0[:, 1] * v2[:, 0]) / area
    inside = (u >= 0) & (v >= 0) & (u + v <= 1) & np.isfinite(area)
    depth = a[:, 2] + u * (b - a)[:, 2] + v * (c - a)[:, 2]
    best = int(np.where(inside, depth, -np.inf).argmax())
    shares = (1 - u[best] - v[best], u[best], v[best])
    normal = np.cross(b[best] - a[best], c[best] - a[best])
    normal *= np.sign(normal[2]) / np.linalg.norm(normal)
    return {int(k): float(s) for k, s in zip(triangles[best], shares, strict=True)}, normal
