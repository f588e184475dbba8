"""Least squares between bounds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

ROUNDS = 100
SMALLEST = 1e-12  # share of the largest unknown: a step that rounding makes


def solve_box(gram: Floats, side: Floats, low: Floats, high: Floats) -> Floats:
    """(unknown,) x that minimises ½ xᵀ·gram·x - sideᵀ·x with low ≤ x ≤ high.

    gram (unknown, unknown) positive definite; bounds may be infinite. Projected Newton steps
    on the unknowns that no bound holds (Bertsekas 1982): the bounds that hold are found many
    at a time, so a face of fifty shapes takes a few rounds.
    """
    best: Floats = np.linalg.solve(gram, side).astype(np.float64)
    x: Floats = np.clip(best, low, high).astype(np.float64)
    if (x == best).all():
        return best
    cost = _cost(gram, side, x)
    for _ in range(ROUNDS):
        slope = gram @ x - side
        held = ((x <= low) & (slope > 0)) | ((x >= high) & (slope < 0))
        free = np.flatnonzero(~held)
        if not len(free):
            break
        step = np.zeros_like(x)
        step[free] = np.linalg.solve(gram[np.ix_(free, free)], -slope[free])
        if np.abs(step).max() < SMALLEST * (1 + np.abs(x).max()):
            break
        share, better = 1.0, False
        while share > 1e-6 and not better:
            tried: Floats = np.clip(x + share * step, low, high).astype(np.float64)
            tried_cost = _cost(gram, side, tried)
            better = tried_cost < cost
            share /= 2
        if not better:
            break
        x, cost = tried, tried_cost
    return x


def _cost(gram: Floats, side: Floats, x: Floats) -> float:
    return float(x @ (gram @ x) / 2 - side @ x)
