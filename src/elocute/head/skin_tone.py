"""Skin tones: one scale from light to dark, as factors of linear colour."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

TONE_SHARES = {"skin": 1.0, "lips": 0.85, "hair": 0.5}
"""How far each material follows the tone."""
LIGHTEST, DARKEST = 0.10, 0.97
_PLACES = (0.0, 0.3, 0.65, 1.0)
_ALBEDO = np.array(
    [[0.565, 0.32, 0.23], [0.50, 0.26, 0.17], [0.27, 0.125, 0.073], [0.115, 0.052, 0.031]]
)
"""Linear skin colour at those places of the scale."""


def skin_albedo(tone: float) -> NDArray[np.float64]:
    """(3,) linear colour of skin at a tone, clipped to what is painted."""
    tone = min(max(tone, LIGHTEST), DARKEST)
    logs = np.log(_ALBEDO)
    return np.exp([np.interp(tone, _PLACES, logs[:, channel]) for channel in range(3)])


def recoloured(
    colors: NDArray[np.uint8], share: NDArray[np.float32], before: float, after: float
) -> NDArray[np.uint8]:
    """(vertex, 3) sRGB with each vertex moved by its share from one tone to another."""
    factor = skin_albedo(after) / skin_albedo(before)
    linear = _linear(colors) * factor ** share[:, None]
    return np.round(255 * _srgb(np.clip(linear, 0, 1))).astype(np.uint8)


def _linear(colors: NDArray[np.uint8]) -> NDArray[np.float64]:
    c = colors / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def _srgb(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    low = linear <= 0.0031308
    return np.where(low, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)
