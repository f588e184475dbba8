"""Cubic interpolation that never overshoots its knots."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import FloatArray, RealArray


def monotone_cubic(times: RealArray, values: FloatArray, at: RealArray) -> NDArray[np.float64]:
    """Cubics (moment, column) between knots that stay between them, with slope zero at both ends.

    Values (knot, column) at rising times (knot,) are read at moments (moment,); beyond both ends
    the end values hold. Slopes are the weighted harmonic means of Fritsch and Butland (1984), as in
    SciPy's `PchipInterpolator`: zero where a value turns back, so nothing swings past a knot
    (weights stay in 0…1, lips closed at two knots stay closed between them), and no stop on the way
    to a further one. Unlike SciPy's, curves start and end at rest.
    """
    if len(times) == 1:
        return np.repeat(np.asarray(values, np.float64), len(at), axis=0)
    slopes = _slopes(times, values)
    inside = np.clip(at, times[0], times[-1])
    below = np.clip(np.searchsorted(times, inside, side="right") - 1, 0, len(times) - 2)
    width = np.diff(times)[below][:, None]
    share = ((inside - times[below])[:, None]) / width
    rest = 1 - share
    # The cubic Hermite polynomials.
    return np.asarray(
        values[below] * rest**2 * (1 + 2 * share)
        + values[below + 1] * share**2 * (3 - 2 * share)
        + width * share * rest * (slopes[below] * rest - slopes[below + 1] * share),
        np.float64,
    )


def _slopes(times: RealArray, values: FloatArray) -> NDArray[np.float64]:
    """(knot, column) slopes at the knots."""
    widths = np.diff(times)[:, None]
    steps = np.diff(values, axis=0) / widths
    slopes = np.zeros(values.shape)
    before, after = steps[:-1], steps[1:]
    onwards = before * after > 0
    w1, w2 = 2 * widths[1:] + widths[:-1], widths[1:] + 2 * widths[:-1]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        mean = (w1 + w2) / (w1 / before + w2 / after)
    slopes[1:-1] = np.where(onwards, mean, 0.0)
    return slopes
