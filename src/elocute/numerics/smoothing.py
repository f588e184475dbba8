"""Easing from 0 to 1, and Gaussian smoothing over time."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Share = TypeVar("Share", bound=NDArray[np.floating])


def smoothstep(share: Share) -> Share:
    """3s² - 2s³ of shares s in 0…1: starts and ends without a jerk."""
    return share * share * (3 - 2 * share)  # pyright: ignore[reportReturnType]


def gaussian_smoothed(values: NDArray[np.floating], deviation: float) -> NDArray[np.float64]:
    """Values (row, …) smoothed over time by a Gaussian; the end values repeat beyond both ends.

    Its standard deviation is in rows, above 0. As `scipy.ndimage.gaussian_filter1d(values,
    deviation, axis=0, mode="nearest", truncate=3)`.
    """
    reach = max(1, round(3 * deviation))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / deviation) ** 2)
    kernel /= kernel.sum()
    flat = np.asarray(values, np.float64).reshape(len(values), -1)
    padded = np.pad(flat, ((reach, reach), (0, 0)), mode="edge")
    smoothed = np.stack([np.convolve(column, kernel, "valid") for column in padded.T], axis=1)
    return smoothed.reshape(values.shape)
