"""The shade of hair on the scalp under it: it ends in fine hairs, not at the edge of the cards."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from recipes.looks.canvas import Canvas, blurred
from recipes.looks.scalp import grows

SIZE, FINER = 1024, 3
INSETS_MM, SOFT_PX = (0.0, 2.5, 5.0), 1.5
"""The shade comes over these distances from the hairline."""
HAIRS = 14000
HAIR_PX, STRAY_DEG = (8.0, 22.0), 24.0
"""Length of the fine hairs at the edge, and how far they stray from the way into the hair."""
BEHIND_MM = -105.0
THIN = 0.75
"""How dark a hair is at most: it is thinner than a pixel."""
REACH_PX, LEAST = 7.0, 0.12
"""How far the fine hairs begin outside of the shade, and where there are none any more."""


def roots(canvas: Canvas) -> np.ndarray:
    """(SIZE, SIZE) 0..1: how much of the scalp lies under hair."""
    # By the place of each pixel: between vertices the line would be jagged.
    axes = [canvas.spread(column, SIZE).ravel() for column in canvas.millimetres.T]
    shares = [grows(np.stack(axes, 1), inset) for inset in INSETS_MM]
    wide = blurred(np.mean(shares, axis=0).reshape(SIZE, SIZE), SOFT_PX)
    # Behind the ears the atlas has no room for single hairs.
    seen = canvas.spread((canvas.millimetres[:, 2] > BEHIND_MM).astype(float), SIZE)
    return np.maximum(wide, _hairs(wide) * seen.clip(0, 1)).clip(0, 1)


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
        draw.line([tuple(place) for place in path], fill=int(strong), width=int(rng.integers(1, 4)))
    fine = np.asarray(picture.resize((SIZE, SIZE), Image.Resampling.BOX), float) / 255
    return THIN * fine / max(float(np.quantile(fine[fine > 0.05], 0.9)), 1e-3)
