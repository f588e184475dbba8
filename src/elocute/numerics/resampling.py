"""Linear interpolation in time: between rows at even times, and between knots at any."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import FloatArray, RealArray

GAP_MAX_S = 0.2
"""Longer gaps are not filled in, since the motion in them is not known."""


def frame_places(first: int, count: int, rate: float, fps: float) -> NDArray[np.float64]:
    """Where frames lie among rows of another rate: row numbers (frame,) with fractions.

    Frames are `first` up to before `first + count`, frame k at k / fps; row k is at k / rate.
    """
    return np.asarray(np.arange(first, first + count) * rate / fps, np.float64)


def neighbours(
    places: FloatArray, count: int
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """The rows (place,) before and after each place, and the share of the row after, 0 to 1.

    Places (place,) are row numbers with fractions; beyond both ends of `count` rows the end row
    holds.
    """
    places = np.clip(places, 0, count - 1)
    below = np.floor(places).astype(np.intp)
    above = np.minimum(below + 1, count - 1)
    return below, above, np.asarray(places - below, np.float64)


def read_rows(values: FloatArray, places: FloatArray) -> NDArray[np.float32]:
    """Rows (row, …) at even times read at other times, (place, …) float32.

    Linear between rows, held beyond both ends; places (place,) are as `frame_places` gives them.
    """
    below, above, share = neighbours(places, len(values))
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    return (values[below] * (1 - share) + values[above] * share).astype(np.float32)


def interpolate(times: RealArray, values: FloatArray, at: RealArray) -> NDArray[np.float64]:
    """Straight lines (moment, column) between knots (knot, column) at any times.

    Times (knot,) rise; the end values hold beyond both ends.
    """
    return np.stack([np.interp(at, times, column) for column in values.T], axis=1)


def frames_in(duration_s: float, fps: float) -> int:
    """Frames that cover a duration in seconds, one at least; a rounding error adds none."""
    return max(1, int(np.ceil(duration_s * fps - 1e-6)))
