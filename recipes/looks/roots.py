"""The shade of hair on the scalp under it, which ends in strokes instead of at the cards' edge."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from elocute.head import HeadModel
from recipes.looks.canvas import Canvas, blurred, noise
from recipes.looks.cards import Cards

SIZE = 1024
NEAR_M, FAR_M = 0.003, 0.0085
"""Skin that is nearer to hair than the first is all shade; further than the second, none."""
SAMPLES = 5
SOLID = 0.35
STROKES = 0.22
"""How far strokes break up the edge."""


def roots(canvas: Canvas, cards: Cards, alpha: np.ndarray) -> np.ndarray:
    """(SIZE, SIZE) 0..1.

    Parameters
    ----------
    alpha : (row, column) array
        Of the cards' picture.
    """
    away, _ = KDTree(_solid_points(canvas.head, cards, alpha)).query(canvas.head.template)
    share = np.clip((FAR_M - away) / (FAR_M - NEAR_M), 0, 1) * _scalp(canvas)
    wide = blurred(canvas.spread(share, SIZE), SIZE / 220)
    strokes = noise(21, SIZE, (5.0, 0.6)) * 4 * wide * (1 - wide)
    return blurred((wide + STROKES * strokes).clip(0, 1), 0.5)


def _scalp(canvas: Canvas) -> np.ndarray:
    """(vertex,) 0..1 where hair grows: long hair also lies on cheeks and neck."""
    x, y, z = canvas.millimetres.T
    side = np.clip((np.abs(x) - 50) / 12, 0, 1) * np.clip((y - 14) / 12, 0, 1)
    above = np.clip((y - 30) / 14, 0, 1)
    behind = np.clip((-118 - z) / 10, 0, 1) * np.clip((y + 62) / 20, 0, 1)
    return np.maximum.reduce([side, above, behind])


def _solid_points(head: HeadModel, cards: Cards, alpha: np.ndarray) -> np.ndarray:
    """(point, 3) on the cards where their picture is not clear."""
    at = (np.arange(SAMPLES) + 0.5) / SAMPLES
    u, v = (axis.ravel() for axis in np.meshgrid(at, at))
    corners = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v])
    worn = np.einsum("vk,vkc->vc", cards.weights, head.template[cards.index]) + cards.offset
    points = np.einsum("ks,qkc->qsc", corners, worn[cards.quads]).reshape(-1, 3)
    texels = np.einsum("ks,qkc->qsc", corners, cards.uv[cards.uv_quads]).reshape(-1, 2)
    row = ((1 - texels[:, 1]) * alpha.shape[0]).astype(int).clip(0, alpha.shape[0] - 1)
    column = (texels[:, 0] * alpha.shape[1]).astype(int).clip(0, alpha.shape[1] - 1)
    return points[alpha[row, column] > SOLID]
