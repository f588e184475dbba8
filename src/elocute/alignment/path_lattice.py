"""The forward sum over all monotone paths, in log space: its marginals and their derivative.

A path takes steps (1, 0), (0, 1) and (1, 1) through a matrix of energies (source frame, target
frame), and is drawn with probability proportional to the exponential of the energies that it
passes. The marginal of a cell is the probability that the path passes it. The product with the
Hessian of the log of the sum, which training through the marginals needs, is exact (Mensch &
Blondel 2018); both take time in proportion to the cells.

All in double precision. With open ends a path may begin and end at any source frame.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from elocute.array_types import Float64Array

Lengths = NDArray[np.int64]


def path_marginals(
    energies: Float64Array, lengths: Lengths, open_source: bool = False
) -> Float64Array:
    """(pair, source, target) energies, (pair, 2) frames of each, to marginals; 0 in the padding."""
    out = np.zeros(energies.shape)
    _batch(energies, energies, lengths, open_source, False, out)
    return out


def marginals_slope(
    energies: Float64Array, direction: Float64Array, lengths: Lengths, open_source: bool = False
) -> Float64Array:
    """How fast the marginals change where the energies change in `direction`.

    The Hessian is symmetric, so this is also what `direction`, given as the gradient of something
    by the marginals, is as its gradient by the energies.
    """
    out = np.zeros(energies.shape)
    _batch(energies, direction, lengths, open_source, True, out)
    return out


@njit(cache=True)
def _batch(energies, direction, lengths, open_source, slope, out):
    for pair in range(len(energies)):
        rows, columns = lengths[pair]
        _one(
            energies[pair, :rows, :columns],
            direction[pair, :rows, :columns],
            open_source,
            slope,
            out[pair, :rows, :columns],
        )


@njit(cache=True)
def _one(energies, direction, open_source, slope, out):
    rows, columns = energies.shape
    total = np.full((rows + 1, columns + 1), -np.inf)  # log of the sum over ways to each cell
    change = np.zeros((rows + 1, columns + 1))  # of it, along `direction`
    came = np.zeros((rows + 1, columns + 1, 3))  # how probably from the corner, above, the left
    came_change = np.zeros((rows + 1, columns + 1, 3))
    total[0, 0] = 0.0
    for i in range(1, rows + 1):
        if open_source:
            total[i, 0] = 0.0
        for j in range(1, columns + 1):
            corner, above, left = total[i - 1, j - 1], total[i - 1, j], total[i, j - 1]
            if j == 1:
                left = -np.inf  # the column of starts is entered from the corner alone
            top = max(corner, above, left)
            p, q, r = np.exp(corner - top), np.exp(above - top), np.exp(left - top)
            ways = p + q + r
            p, q, r = p / ways, q / ways, r / ways
            came[i, j, 0], came[i, j, 1], came[i, j, 2] = p, q, r
            total[i, j] = top + np.log(ways) + energies[i - 1, j - 1]
            if slope:
                a, b, c = change[i - 1, j - 1], change[i - 1, j], change[i, j - 1]
                mean = p * a + q * b + r * c
                change[i, j] = mean + direction[i - 1, j - 1]
                came_change[i, j, 0] = p * (a - mean)
                came_change[i, j, 1] = q * (b - mean)
                came_change[i, j, 2] = r * (c - mean)
    passed = np.zeros((rows + 1, columns + 1))
    passed_change = np.zeros((rows + 1, columns + 1))
    _ends(total, change, open_source, slope, passed, passed_change)
    for i in range(rows, 0, -1):
        for j in range(columns, 0, -1):
            here, moved = passed[i, j], passed_change[i, j]
            for way in range(3):
                k = i if way == 2 else i - 1
                m = j if way == 1 else j - 1
                passed[k, m] += here * came[i, j, way]
                if slope:
                    passed_change[k, m] += moved * came[i, j, way] + here * came_change[i, j, way]
    result = passed_change if slope else passed
    for i in range(rows):
        for j in range(columns):
            out[i, j] = result[i + 1, j + 1]


@njit(cache=True)
def _ends(total, change, open_source, slope, passed, passed_change):
    """How probably a path ends in each cell of the last column, and how that changes."""
    rows, last = len(total) - 1, total.shape[1] - 1
    if not open_source:
        passed[rows, last] = 1.0
        return
    top, ways, mean = -np.inf, 0.0, 0.0
    for i in range(1, rows + 1):
        top = max(top, total[i, last])
    for i in range(1, rows + 1):
        passed[i, last] = np.exp(total[i, last] - top)
        ways += passed[i, last]
    for i in range(1, rows + 1):
        passed[i, last] /= ways
        mean += passed[i, last] * change[i, last]
    if slope:
        for i in range(1, rows + 1):
            passed_change[i, last] = passed[i, last] * (change[i, last] - mean)
