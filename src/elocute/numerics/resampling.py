"""Linear interpolation in time: between rows at even times, and between knots at any."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import FloatArray, RealArray

GAP_MAX_S = 0.2
"""Frames that are missing for longer are not filled in: nobody knows where the mouth went."""


def frame_places(first: int, count: int, rate: float, fps: float) -> NDArray[np.float64]:
    """Where frames lie among rows of another rate.

    Parameters
    ----------
    first, count
        Which frames: `first` up to before `first + count`.
    rate
        Rows per second; row k is at k / rate.
    fps
        Frames per second; frame k is at k / fps.

    Returns
    -------
    (frame,) row numbers, with fractions between rows.
    """
    return np.asarray(np.arange(first, first + count) * rate / fps, np.float64)


def neighbours(
    places: FloatArray, count: int
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """The rows on both sides of each place, and the share of the second.

    Parameters
    ----------
    places
        (place,) row numbers with fractions; beyond both ends the end row holds.
    count
        Number of rows, one at least.

    Returns
    -------
    (place,) row before, (place,) row after, (place,) share of the row after, 0 to 1.
    """
    places = np.clip(places, 0, count - 1)
    below = np.floor(places).astype(np.intp)
    above = np.minimum(below + 1, count - 1)
    return below, above, np.asarray(places - below, np.float64)


def read_rows(values: FloatArray, places: FloatArray) -> NDArray[np.float32]:
    """Rows at even times read at other times: linear between rows, held beyond both ends.

    Parameters
    ----------
    values
        (row, …), one row at least.
    places
        (place,) row numbers with fractions, as `frame_places` gives.

    Returns
    -------
    (place, …) float32.
    """
    below, above, share = neighbours(places, len(values))
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    return (values[below] * (1 - share) + values[above] * share).astype(np.float32)


def interpolate(times: RealArray, values: FloatArray, at: RealArray) -> NDArray[np.float64]:
    """Straight lines between knots at any times; the end values hold beyond both ends.

    Parameters
    ----------
    times
        (knot,) rising.
    values
        (knot, column).
    at
        (moment,) in the unit of `times`.

    Returns
    -------
    (moment, column).
    """
    return np.stack([np.interp(at, times, column) for column in values.T], axis=1)


def frames_in(duration_s: float, fps: float) -> int:
    """Frames that cover a duration in seconds, one at least; a rounding error adds none."""
    return max(1, int(np.ceil(duration_s * fps - 1e-6)))
