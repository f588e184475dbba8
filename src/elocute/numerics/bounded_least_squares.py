"""Least squares between bounds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from elocute.array_types import Float64Array

ROUNDS = 100
SMALLEST = 1e-12  # share of the largest unknown: a step that rounding makes
SUM_EXACT = 1e-7  # of a limited sum
SWEEPS = 6  # along a chain
GRADIENT_STEPS = 300


def solve_box(
    gram: Float64Array,
    side: Float64Array,
    low: Float64Array,
    high: Float64Array,
    start: Float64Array | None = None,
) -> Float64Array:
    """(unknown,) x that minimises ½ xᵀ·gram·x - sideᵀ·x with low ≤ x ≤ high.

    gram (unknown, unknown) positive definite; bounds may be infinite. Projected Newton steps
    on the unknowns that no bound holds (Bertsekas 1982): the bounds that hold are found many
    at a time, so a face of fifty shapes takes a few rounds; fewer from a `start` that is near.
    """
    best: Float64Array = np.linalg.solve(gram, side).astype(np.float64)
    x: Float64Array = np.clip(best, low, high).astype(np.float64)
    if (x == best).all():
        return best
    x = x if start is None else np.clip(start, low, high)
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
        share = 1.0
        while share > 1e-6:
            tried: Float64Array = np.clip(x + share * step, low, high).astype(np.float64)
            tried_cost = _cost(gram, side, tried)
            if tried_cost < cost:
                break
            share /= 2
        else:
            # Bounds bend the step upwards; each unknown by itself still goes down.
            tried = _swept(gram, side, low, high, x)
            tried_cost = _cost(gram, side, tried)
            if tried_cost >= cost:
                break
        x, cost = tried, tried_cost
    return x


def _swept(
    gram: Float64Array, side: Float64Array, low: Float64Array, high: Float64Array, x: Float64Array
) -> Float64Array:
    """Each unknown in turn at its best between its bounds."""
    x = x.copy()
    for place in range(len(x)):
        best = x[place] - (gram[place] @ x - side[place]) / gram[place, place]
        x[place] = min(max(best, low[place]), high[place])
    return x


def solve_box_sum(
    gram: Float64Array,
    side: Float64Array,
    low: Float64Array,
    high: Float64Array,
    group: Float64Array,
    most: float = 1.0,
    start: Float64Array | None = None,
) -> Float64Array:
    """(unknown,) as `solve_box`, with group·x ≤ most as well.

    group (unknown,) ones and zeros; what `low` demands of it must fit. The sum falls with its
    price in straight pieces, so Newton's steps find the price in a few; where they leave the
    bracket, it is halved.
    """
    x = solve_box(gram, side, low, high, start)
    price, cheap, dear = 0.0, 0.0, np.inf
    for _ in range(ROUNDS):
        over = float(group @ x) - most
        if over <= 0 and (price == 0 or over > -SUM_EXACT):
            break
        cheap, dear = (price, dear) if over > 0 else (cheap, price)
        free = np.flatnonzero((x > low) & (x < high))
        part = group[free]
        slope = float(part @ np.linalg.solve(gram[np.ix_(free, free)], part)) if part.any() else 0.0
        price += (over + SUM_EXACT / 2) / slope if slope > 0 else np.inf
        if not cheap < price < dear:
            price = (
                (cheap + dear) / 2 if np.isfinite(dear) else 2 * cheap + float(np.abs(side).max())
            )
        x = solve_box(gram, side - price * group, low, high, start=x)
    return x


def solve_box_chain(
    gram_of: Callable[[int], Float64Array],
    sides: Float64Array,
    smooth: Float64Array,
    low: Float64Array,
    high: Float64Array,
    sweeps: int = SWEEPS,
) -> Float64Array:
    """Solve least squares for frames that follow one another smoothly, within bounds (unknown,).

    Minimises Σ_f ½ x_fᵀ·gram_f·x_f - side_fᵀ·x_f + ½ Σ_f (x_f - x_{f-1})ᵀ·diag(smooth)·(…):
    Gauss-Seidel, each frame in turn between its neighbours, back and forth, as often as `sweeps`
    says. `gram_of` gives the positive definite matrix (unknown, unknown) of a frame; sides are
    (frame, unknown), and `smooth` (unknown,) is the cost of a squared change between two frames.

    Returns
    -------
    (frame, unknown)
        The minimum.
    """
    frames = len(sides)
    x = np.zeros_like(sides)
    for sweep in range(sweeps):
        order = range(frames) if sweep % 2 == 0 else range(frames - 1, -1, -1)
        for frame in order:
            near = [g for g in (frame - 1, frame + 1) if 0 <= g < frames]
            if sweep == 0:
                near = [g for g in near if g < frame]  # the others are not known yet
            gram = gram_of(frame) + np.diag(len(near) * smooth)
            toward = sides[frame] + smooth * x[near].sum(axis=0)
            guess = x[frame - 1 if sweep == 0 and frame else frame]
            same = _same_bounds(gram, toward, low, high, guess)
            x[frame] = solve_box(gram, toward, low, high) if same is None else same
    return x


def solve_box_rows(
    gram: Float64Array, sides: Float64Array, low: float, high: float
) -> Float64Array:
    """Minimise ½ xᵀ·gram·x - sideᵀ·x with low ≤ x ≤ high for sides (row, unknown) at once.

    For thousands of rows with one positive definite matrix, where `solve_box` row by row would take
    too long. Projected gradients with momentum (Beck and Teboulle 2009): what has not settled after
    GRADIENT_STEPS differs by less than can be seen on a face.

    Returns
    -------
    (row, unknown)
        The minimum of each row.
    """
    length = float(np.linalg.eigvalsh(gram)[-1])
    x = ahead = np.clip(sides @ np.linalg.inv(gram), low, high)
    pace = 1.0
    for _ in range(GRADIENT_STEPS):
        before, x = x, np.clip(ahead - (ahead @ gram - sides) / length, low, high)
        faster = (1 + np.sqrt(1 + 4 * pace**2)) / 2
        ahead, pace = x + (pace - 1) / faster * (x - before), faster
    return x


def _same_bounds(
    gram: Float64Array,
    side: Float64Array,
    low: Float64Array,
    high: Float64Array,
    guess: Float64Array,
) -> Float64Array | None:
    """The solution if the same bounds hold as in `guess`, which is mostly so; else None."""
    free = (guess > low) & (guess < high)
    tried = guess.copy()
    if free.any():
        left = side[free] - gram[np.ix_(free, ~free)] @ guess[~free]
        tried[free] = np.linalg.solve(gram[np.ix_(free, free)], left)
    slope = gram @ tried - side
    inside = (tried[free] >= low[free]).all() and (tried[free] <= high[free]).all()
    held = (slope[guess <= low] >= 0).all() and (slope[guess >= high] <= 0).all()
    return tried if inside and held else None


def _cost(gram: Float64Array, side: Float64Array, x: Float64Array) -> float:
    return float(x @ (gram @ x) / 2 - side @ x)
