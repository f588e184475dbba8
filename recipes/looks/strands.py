"""Pictures of strands: hair, brows and lashes in grey, to be tinted, with their alpha."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.ndimage as ndimage
from PIL import Image

from recipes.looks.canvas import blurred, luma

SOLID = 0.5


EVENED = 0.75
"""Share of the difference between light and dark tufts that is taken away."""


def strands(path: Path, size: int, gain: float = 1.0, even: float = 0.0) -> np.ndarray:
    """(size, size, 4): brightness 0.30 to 1 in all three colours, whatever was painted, and
    alpha. Clear texels take the brightness of the nearest solid ones, or fringes would be dark.
    What is wider than `even` pixels is evened out: the renderer lights hair, not the painter."""
    picture = Image.open(path).convert("RGBA")
    if picture.width > size:
        picture = picture.resize(
            (size, size * picture.height // picture.width), Image.Resampling.LANCZOS
        )
    values = np.asarray(picture, float) / 255
    bright, alpha = luma(values[..., :3]), values[..., 3]
    solid = alpha > SOLID if (alpha > SOLID).any() else alpha > alpha.max() / 2
    if even:
        around = blurred(bright * solid, even) / np.maximum(blurred(solid * 1.0, even), 1e-3)
        bright = bright * (bright[solid].mean() / np.maximum(around, 0.02)) ** EVENED
    low, high = np.percentile(bright[solid], [3, 98])
    tone = np.clip((bright - low) / max(high - low, 1e-3), 0, 1)
    nearest = ndimage.distance_transform_edt(
        alpha < 0.3, return_distances=False, return_indices=True
    )
    rows, columns = np.asarray(nearest)
    tone = tone[rows, columns]
    grey = 0.30 + 0.70 * tone**0.9
    return np.dstack([grey, grey, grey, np.clip(alpha * gain, 0, 1)])
