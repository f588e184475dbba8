"""Fits long hair to shoulders and clothes."""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float32Array
from elocute.head.looks.cards import Cards
from elocute.head.model import HeadModel
from elocute.head.normals import vertex_normals

LEAST_M, FREE_M, DEEP_M = 0.002, 0.006, 0.045
"""Hair this deep in cloth comes to lie the first over it; hair the second over it stays where it
is, and what is between keeps its order."""
BESIDE_M = 0.010
"""What lies further beside a place of the cloth is not moved by it; from half of it on, less."""
TIMES, AT_A_TIME = 2, 512
"""Once more for what came out of the shirt, and into its collar."""


def laid_on(hair: Cards, clothes: Cards, head: HeadModel) -> Cards:
    """Hair that lies on clothes, not in them; its offsets change where it was in the cloth or
    nearly so.

    Both are in the size of the bare head on which they hang.
    """
    points, cloth = hair.points(head.template), clothes.points(head.template)
    triangles = clothes.quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    normals = vertex_normals(cloth, triangles)
    low = np.flatnonzero(points[:, 1] < cloth[:, 1].max() + FREE_M)
    offset = hair.offset.copy()
    for start in range(0, len(low), AT_A_TIME):
        part = low[start : start + AT_A_TIME]
        for _ in range(TIMES):
            moved = _out_of(points[part], cloth, normals)
            points[part] += moved
            offset[part] += moved
    return hair.with_offset(offset)


def _out_of(points: Float32Array, cloth: Float32Array, normals: Float32Array) -> Float32Array:
    """(n, 3) m: how far points move, along the normals of the nearest vertices of the cloth."""
    nearest = ((cloth**2).sum(1) - 2 * points @ cloth.T).argmin(1)
    normal, away = normals[nearest], points - cloth[nearest]
    above = (away * normal).sum(1, keepdims=True)
    beside = np.linalg.norm(away - above * normal, axis=1, keepdims=True)
    wanted = np.interp(above, (-DEEP_M, FREE_M), (LEAST_M, FREE_M))
    share = np.clip(2 - 2 * beside / BESIDE_M, 0, 1)
    return np.asarray(share * np.maximum(wanted - above, 0) * normal, np.float32)
