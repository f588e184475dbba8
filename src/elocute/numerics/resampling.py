"""Rows that stand at even times, read at other times."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def frame_places(first: int, count: int, rate: float, fps: float) -> NDArray[np.float64]:
    """(frame,) where frames `first` … of `fps` lie among rows of `rate` Hz."""
    return np.asarray(np.arange(first, first + count) * rate / fps, np.float64)


def read_rows(values: NDArray[np.floating], places: NDArray[np.float64]) -> NDArray[np.float32]:
    """(place, …) of rows (row, …): linear between rows, held beyond both ends."""
    places = np.clip(places, 0, len(values) - 1)
    below = np.floor(places).astype(np.intp)
    above = np.minimum(below + 1, len(values) - 1)
    share = (places - below).reshape(-1, *[1] * (values.ndim - 1))
    return (values[below] * (1 - share) + values[above] * share).astype(np.float32)


def frames_in(duration_s: float, fps: float) -> int:
    """Frames that cover a duration, one at least; a rounding error makes none."""
    return max(1, int(np.ceil(duration_s * fps - 1e-6)))
