"""Short-time spectra: Hann windows, the mel scale, triangular filters, the cosine transform."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array

MelScale = Literal["htk", "slaney"]

SLANEY_KNEE_HZ, SLANEY_STEP_HZ = 1000.0, 200.0 / 3  # linear below the knee, logarithmic above
SLANEY_LOG_STEP = np.log(6.4) / 27.0


def hann(length: int) -> NDArray[np.float64]:
    """(length,) periodic Hann window, as `scipy.signal.windows.hann(length, sym=False)`."""
    return 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(length) / length)


def hz_to_mel(hz: Float64Array | float, scale: MelScale = "htk") -> Float64Array:
    """Mel of a frequency in Hz: HTK's formula, or Slaney's Auditory Toolbox (1998)."""
    hz = np.asarray(hz, float)
    if scale == "htk":
        return 2595.0 * np.log10(1 + hz / 700.0)
    knee = SLANEY_KNEE_HZ / SLANEY_STEP_HZ
    above = knee + np.log(np.maximum(hz, 1e-9) / SLANEY_KNEE_HZ) / SLANEY_LOG_STEP
    return np.where(hz < SLANEY_KNEE_HZ, hz / SLANEY_STEP_HZ, above)


def mel_to_hz(mel: Float64Array | float, scale: MelScale = "htk") -> Float64Array:
    """The inverse of `hz_to_mel`."""
    mel = np.asarray(mel, float)
    if scale == "htk":
        return 700.0 * (10 ** (mel / 2595.0) - 1)
    knee = SLANEY_KNEE_HZ / SLANEY_STEP_HZ
    above = SLANEY_KNEE_HZ * np.exp(SLANEY_LOG_STEP * (mel - knee))
    return np.where(mel < knee, mel * SLANEY_STEP_HZ, above)


def mel_points(low_hz: float, high_hz: float, count: int, scale: MelScale = "htk") -> Float64Array:
    """(count,) frequencies in Hz from `low_hz` to `high_hz`, evenly spaced in mel."""
    low, high = hz_to_mel(low_hz, scale), hz_to_mel(high_hz, scale)
    return mel_to_hz(np.linspace(low, high, count), scale)


def triangles(
    corners: Float64Array, places: NDArray[np.floating] | NDArray[np.integer]
) -> Float64Array:
    """Overlapping triangles (band, place) of height one, read at places (place,).

    Corners (band + 2,) do not fall: band b rises from corner b to b + 1 and falls to b + 2. A side
    of no width is a step (the second corner itself belongs to the side that falls).
    """
    low, middle, high = corners[:-2, None], corners[1:-1, None], corners[2:, None]
    up, down = middle - low, high - middle
    rising = np.where(up > 0, (places - low) / np.where(up > 0, up, 1.0), places >= low)
    falling = np.where(down > 0, (high - places) / np.where(down > 0, down, 1.0), places < high)
    return np.maximum(0, np.minimum(rising, falling))


def dct_matrix(size: int) -> NDArray[np.float64]:
    """(input, output) orthonormal DCT-II: `rows @ dct_matrix(size)` transforms rows."""
    n = np.arange(size)
    matrix = np.cos(np.pi * (2 * n[:, None] + 1) * n / (2 * size)) * np.sqrt(2 / size)
    matrix[:, 0] /= np.sqrt(2)
    return matrix
