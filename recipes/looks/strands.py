"""Pictures of strands: hair, brows and lashes in grey, to be tinted, with their alpha."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.ndimage as ndimage
from PIL import Image

from recipes.looks.canvas import blurred, luma, noise

SOLID = 0.5


EVENED = 0.75
"""Share of the difference between light and dark tufts that is taken away."""


LOCKS, SINGLE = (26.0, 7.0, 2.2, 0.9), (0.34, 0.30, 0.36, 0.42)
"""Widths of locks and single hairs in a picture of 1024 pixels, and how far they differ in tone."""
LONG = 75.0
"""How many times longer than wide."""
WANDER, WANDER_PX = 7.0, (90.0, 160.0)
"""How far hairs sway aside, and over how many pixels across and along."""
PAINTED = 0.8
"""What is kept of the painter's hairs, whose light and shade are left out."""
FRAY_PX = 150
"""From the tips upward, how far single hairs end before the others."""


def long_strands(path: Path, size: int) -> np.ndarray:
    """(size, size, 4) as `strands`, of hair that falls straight down its picture: hairs are drawn
    anew over the painter's, which are few and blurred."""
    drawn = strands(path, size, even=size / 14)
    alpha = _enlarged(drawn[..., 3], size)
    tone = _enlarged(drawn[..., 0], size)
    fine = tone - ndimage.gaussian_filter(tone, (0.0, size / 60))
    lines = hairs(size)
    tone = (0.62 + PAINTED * fine + 0.13 * lines).clip(0.30, 1.0)
    return np.dstack([tone, tone, tone, _frayed(alpha, lines, size)])


def _enlarged(values: np.ndarray, size: int) -> np.ndarray:
    picture = Image.fromarray((values * 255).astype(np.uint8))
    return np.asarray(picture.resize((size, size), Image.Resampling.BICUBIC), float) / 255


def hairs(size: int) -> np.ndarray:
    """(size, size) of mean 0 and deviation 1: stripes along the rows that sway."""
    scale = size / 1024
    layers = [
        share * noise(31 + k, size, (max(LONG * width, 60) * scale, width * scale / 2))
        for k, (width, share) in enumerate(zip(LOCKS, SINGLE, strict=True))
    ]
    stripes = np.sum(layers, axis=0)
    across, along = WANDER_PX
    sway = WANDER * scale * noise(40, size, (along * scale, across * scale))
    rows, columns = np.indices((size, size), float)
    swayed = ndimage.map_coordinates(stripes, [rows, columns + sway], order=1, mode="wrap")
    return swayed / swayed.std()


def _frayed(alpha: np.ndarray, hairs: np.ndarray, size: int) -> np.ndarray:
    """Tips of different lengths, and sides that are hairs instead of a cut; roots stay."""
    solid = alpha > SOLID
    reach = FRAY_PX * size / 1024
    below = np.cumsum(solid[::-1], axis=0)[::-1]  # solid pixels from here to the tips
    side = np.minimum(_run(solid), _run(solid[:, ::-1])[:, ::-1])
    lower = np.clip(below / reach, 0, 1)
    edge = np.clip(side / (reach / 8), 0, 1)
    kept = np.minimum(lower, edge) * 2.2 - 1.1 + 0.55 * hairs + 0.75
    return np.minimum(alpha, np.clip(kept * 2.5, 0, 1))


def _run(solid: np.ndarray) -> np.ndarray:
    """How many solid pixels lie in a row, from the left up to each."""
    columns = np.arange(solid.shape[1])
    last_clear = np.maximum.accumulate(np.where(solid, -1, columns), axis=1)
    return columns - last_clear


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
