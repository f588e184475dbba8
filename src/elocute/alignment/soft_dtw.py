"""Soft-DTW (Cuturi & Blondel 2017): a smooth minimum over all paths.

Its gradient by the costs is how often each cell is passed by a path drawn with probability
proportional to exp(-cost / gamma): the expected alignment.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from elocute.alignment.alignment import WarpingPath
from elocute.alignment.dtw import CostMatrix, dtw
from elocute.array_types import Float64Array
from elocute.errors import AlignmentError


def soft_dtw(
    cost: CostMatrix, gamma: float, open_source: bool = False
) -> tuple[float, Float64Array]:
    """The soft minimum and the expected alignment (source frame, target frame).

    gamma is in the unit of the costs; towards 0 it is DTW. Raises AlignmentError.
    """
    if cost.ndim != 2 or not cost.size or not np.isfinite(cost).all():
        raise AlignmentError.about(
            "cost", found=f"shape {cost.shape}", allowed="(source, target), finite"
        )
    if not (np.isfinite(gamma) and gamma > 0):
        raise AlignmentError.about("gamma", found=f"{gamma}", allowed="above 0")
    scaled = np.ascontiguousarray(cost, np.float64) / gamma
    forward, value = _forward(scaled, open_source)
    return gamma * float(value), _expected(scaled, forward, value, open_source)


def soft_path(
    expected: Float64Array, band: float | None = None, open_source: bool = False
) -> WarpingPath:
    """The most probable path, each cell taken by itself.

    A cell costs minus the logarithm of its expectation, so an improbable step is never made for
    the sake of a longer path.
    """
    return dtw(-np.log(np.clip(expected, 1e-12, 1.0)), band, open_source)[0]


@njit(cache=True)
def _soft_minimum(a, b, c):
    least = min(a, b, c)
    if least == np.inf:
        return np.inf
    return least - np.log(np.exp(least - a) + np.exp(least - b) + np.exp(least - c))


@njit(cache=True)
def _forward(cost, open_source):
    """Soft minimum over ways to each cell, in units of gamma, and over all of them."""
    rows, columns = cost.shape
    soft = np.full((rows + 1, columns + 1), np.inf)
    soft[0, 0] = 0.0
    for i in range(1, rows + 1):
        if open_source:
            soft[i, 0] = 0.0
        for j in range(1, columns + 1):
            # With open ends a way begins at (i, 1) from nothing: only the corner is its start.
            left = soft[i, j - 1] if j > 1 or not open_source else np.inf
            best = _soft_minimum(soft[i - 1, j - 1], soft[i - 1, j], left)
            soft[i, j] = cost[i - 1, j - 1] + best
    value = soft[rows, columns]
    if open_source:
        value = np.inf
        for i in range(1, rows + 1):
            value = _soft_minimum(value, soft[i, columns], np.inf)
    return soft, value


@njit(cache=True)
def _expected(cost, soft, value, open_source):
    """The gradient, backwards: a share of each cell's weight goes to the three before it."""
    rows, columns = cost.shape
    weight = np.zeros((rows + 1, columns + 1))
    for i in range(rows, 0, -1):
        for j in range(columns, 0, -1):
            here = 0.0
            if j == columns and (open_source or i == rows):
                here = np.exp(value - soft[i, j])
            reached = soft[i, j]
            if i < rows:
                here += weight[i + 1, j] * np.exp(soft[i + 1, j] - cost[i, j - 1] - reached)
                if j < columns:
                    ahead = soft[i + 1, j + 1] - cost[i, j] - reached
                    here += weight[i + 1, j + 1] * np.exp(ahead)
            if j < columns:
                here += weight[i, j + 1] * np.exp(soft[i, j + 1] - cost[i - 1, j] - reached)
            weight[i, j] = here
    return weight[1:, 1:].copy()
