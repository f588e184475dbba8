"""The relief of a tongue: papillae, and the furrow along its middle."""

from __future__ import annotations

import numpy as np
import scipy.ndimage as ndimage

from elocute.head.model import HeadModel
from recipes.looks.canvas import noise

SIZE = 256
PAPILLA_PX, PAPILLA_MM = (0.9, 2.4), (0.070, 0.120)
"""Width of the fine and of the coarse bumps on the picture, and their height."""
FURROW_MM = (0.9, 0.20)
"""Half width of the furrow, and its depth."""


def relief(head: HeadModel, size: int = SIZE) -> np.ndarray:
    """(size, size, 3) 0..1: normals on the tongue's own texture, which is the tongue from above."""
    x_mm = 1000 * head.template[head.regions["tongue"]]
    step_mm = np.ptp(x_mm, axis=0)[[0, 2]].max() / 0.98 / size
    across = (np.arange(size) + 0.5 - 0.01 * size) * step_mm + x_mm[:, 0].min()
    height = sum(
        deep * np.maximum(noise(seed, size, wide), -0.6)
        for seed, (wide, deep) in enumerate(zip(PAPILLA_PX, PAPILLA_MM, strict=True), 71)
    )
    height = height - FURROW_MM[1] * np.exp(-((across / FURROW_MM[0]) ** 2))
    slope_x, slope_y = (ndimage.sobel(height, axis) / 8 / step_mm for axis in (1, 0))
    normal = np.stack([-slope_x, slope_y, np.ones_like(height)], -1)
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True) * 0.5 + 0.5
