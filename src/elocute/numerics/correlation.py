"""Pearson's correlation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

STILL = 1e-12
"""Share of its own length by which rounding moves a series that does not change."""


def pearson(first: NDArray[np.floating], second: NDArray[np.floating]) -> float:
    """Pearson's r of two series (value,), -1 to 1; 0 where one of them does not change."""
    a, b = (np.asarray(series, np.float64) for series in (first, second))
    still = [STILL * np.linalg.norm(series) for series in (a, b)]
    a, b = a - a.mean(), b - b.mean()
    lengths = [float(np.linalg.norm(series)) for series in (a, b)]
    if lengths[0] <= still[0] or lengths[1] <= still[1]:
        return 0.0
    return float(a @ b / (lengths[0] * lengths[1]))
