"""The shade of hair on the scalp under it: it ends in fine hairs, not at the edge of the cards."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw
from scipy.spatial import KDTree

from elocute.head import HeadModel
from recipes.looks.canvas import Canvas, blurred
from recipes.looks.cards import Cards

SIZE, FINER = 1024, 3
NEAR_M, FAR_M = 0.003, 0.0075
"""Skin that is nearer to hair than the first is all shade; further than the second, none."""
SAMPLES = 5
SOLID = 0.35
HAIRS = 9000
HAIR_PX, STRAY_DEG = (9.0, 26.0), 24.0
"""Length of the fine hairs at the edge, and how far they stray from the way into the hair."""
BEHIND_MM = -105.0
THIN = 0.55
"""How dark a hair is at most: it is thinner than a pixel."""
REACH_PX, LEAST = 7.0, 0.12
"""How far the fine hairs begin outside of the shade, and where there are none any more."""


def roots(canvas: Canvas, share: np.ndarray) -> np.ndarray:
    """(SIZE, SIZE) 0..1, of how much of the scalp lies under hair (head's vertex,)."""
    wide = blurred(canvas.spread(share, SIZE), SIZE / 260)
    # Behind the ears the atlas has no room for single hairs.
    seen = canvas.spread((canvas.millimetres[:, 2] > BEHIND_MM).astype(float), SIZE)
    return np.maximum(wide, _hairs(wide) * seen.clip(0, 1)).clip(0, 1)


def covered(canvas: Canvas, cards: Cards, alpha: np.ndarray) -> np.ndarray:
    """(vertex,) 0..1: how much of the head's scalp lies under cards; `alpha` is their picture's."""
    away, _ = KDTree(_solid_points(canvas.head, cards, alpha)).query(canvas.head.template)
    return np.clip((FAR_M - away) / (FAR_M - NEAR_M), 0, 1) * _scalp(canvas)


def _hairs(wide: np.ndarray) -> np.ndarray:
    """(SIZE, SIZE) 0..1: fine hairs whose roots lie where the shade ends, and a little before."""
    rng = np.random.default_rng(21)
    around = blurred(wide, REACH_PX)
    rows, columns = np.nonzero((around > LEAST) & (wide < 0.9))
    likely = (around[rows, columns] - LEAST) ** 1.1
    chosen = rng.choice(len(rows), HAIRS, p=likely / likely.sum())
    down, across = np.gradient(blurred(wide, 2 * REACH_PX))
    angle = np.arctan2(down, across)[rows[chosen], columns[chosen]]
    angle += np.radians(STRAY_DEG) * rng.normal(size=HAIRS)
    bend = np.radians(STRAY_DEG) * rng.normal(size=HAIRS)
    length = rng.uniform(*HAIR_PX, HAIRS)
    picture = Image.new("L", (SIZE * FINER, SIZE * FINER))
    draw = ImageDraw.Draw(picture)
    start = np.stack([columns[chosen], rows[chosen]], 1) + rng.uniform(0, 1, (HAIRS, 2))
    for k in rng.permutation(HAIRS):
        turned = angle[k] + bend[k] * np.array([0.0, 0.5, 1.0])
        steps = np.stack([np.cos(turned), np.sin(turned)], 1) * length[k] / 3
        path = (start[k] + np.vstack([np.zeros(2), np.cumsum(steps, 0)])) * FINER
        strong = 255 * rng.uniform(0.45, 1.0)
        draw.line([tuple(place) for place in path], fill=int(strong), width=int(rng.integers(1, 3)))
    fine = np.asarray(picture.resize((SIZE, SIZE), Image.Resampling.BOX), float) / 255
    return THIN * fine / max(float(np.quantile(fine[fine > 0.05], 0.9)), 1e-3)


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
