"""Frames in between: another frame rate without overshoot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float64Array = NDArray[np.float64]


def between(values: Float64Array, places: Float64Array) -> Float64Array:
    """(place, column) of frames (frame, column): cubic, without overshoot (Fritsch and Butland).

    So weights stay in 0..1, and lips closed in two frames stay closed between them.
    """
    if len(values) < 2:
        return np.repeat(values, len(places), axis=0)
    step = np.diff(values, axis=0)
    before, after = step[:-1], step[1:]
    same = before * after > 0
    slope = np.zeros_like(values)
    slope[1:-1][same] = 2 * before[same] * after[same] / (before[same] + after[same])
    places = np.clip(places, 0, len(values) - 1)
    start = np.minimum(places.astype(int), len(values) - 2)
    t = (places - start)[:, None]
    first, last = values[start], values[start + 1]
    return (
        (1 + 2 * t) * (1 - t) ** 2 * first
        + t * (1 - t) ** 2 * slope[start]
        + t * t * (3 - 2 * t) * last
        + t * t * (t - 1) * slope[start + 1]
    )
