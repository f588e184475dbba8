"""The shade of hair on the scalp under it: it ends in fine hairs, not at the edge of the cards."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from recipes.looks.canvas import Canvas, blurred
from recipes.looks.scalp import depth_mm

SIZE, FINER = 1024, 3
SHADE_MM, SOFT_PX = (3.0, 18.0), 5.0
"""Between these depths behind the hairline the shade comes."""
HAIRS, HAIRS_MM = 22000, (0.5, 11.0, 20.0)
"""Fine hairs that are drawn: from which depth more grow, where most do, where none is seen."""
HAIR_PX, STRAY_DEG = (8.0, 20.0), 14.0
"""Length of the fine hairs, and how far they stray from the way into the hair."""
SIDE_MM, SIDE_DOWN = (46.0, 22.0), 1.5
"""Between these heights over the eyes hair turns from back to down, and how much."""
BEHIND_MM = -108.0
THIN = 0.22
"""How dark a hair is at most: it is thinner than a pixel."""


def roots(canvas: Canvas) -> np.ndarray:
    """(SIZE, SIZE) 0..1: how much of the scalp lies under hair."""
    # By the place of each pixel: between vertices the line would be jagged.
    axes = [canvas.spread(column, SIZE).ravel() for column in canvas.millimetres.T]
    depth = depth_mm(np.stack(axes, 1)).reshape(SIZE, SIZE)
    wide = blurred(np.interp(depth, SHADE_MM, (0, 1)) ** 1.5, SOFT_PX)
    # Behind the ears the atlas has no room for single hairs.
    seen = axes[2].reshape(SIZE, SIZE) > BEHIND_MM
    hairs = _hairs(depth, axes[1].reshape(SIZE, SIZE), seen)
    return (1 - (1 - wide) * (1 - hairs)).clip(0, 1)


def _hairs(depth: np.ndarray, height: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """(SIZE, SIZE) 0..1: fine hairs, few at the hairline and more behind it."""
    rng = np.random.default_rng(21)
    likely = np.interp(depth, (0.0, *HAIRS_MM), (0, 0.06, 1, 0)) * seen
    rows, columns = np.nonzero(likely)
    share = likely[rows, columns]
    chosen = rng.choice(len(rows), HAIRS, p=share / share.sum())
    down, across = np.gradient(blurred(depth, 8.0))
    steep = np.hypot(down, across) + 1e-6
    down = down / steep + SIDE_DOWN * np.interp(-height, [-each for each in SIDE_MM], (0, 1))
    angle = np.arctan2(down, across / steep)[rows[chosen], columns[chosen]]
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
    return THIN * np.clip(fine / float(np.quantile(fine[fine > 0.05], 0.9)), 0, 1)
