"""How far raters agree: Krippendorff's alpha (Krippendorff 2011), 1 for all, 0 for chance.

    α = 1 − observed disagreement / disagreement expected by chance

over all pairs of answers to one unit, whoever answered it and however many did.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.evaluation.confidence_intervals import NO_INTERVAL, ConfidenceInterval
from elocute.study.statistics.two_way import codes_of

DRAWS = 500
CELLS_MAX = 5_000_000
"""Units by kinds of answers."""


@dataclass(frozen=True)
class _Units:
    """Units with two answers or more, as points: disagreement is their squared distance."""

    sizes: NDArray[np.float64]  # (unit,) answers
    sums: NDArray[np.float64]  # (unit, axis) of their points
    squares: NDArray[np.float64]  # (unit,) sums of their points' squared lengths

    def alpha(self, rows: NDArray[np.intp] | None = None) -> float:
        """Of all units, or of some, which may be there more than once."""
        sizes, sums, squares = self.sizes, self.sums, self.squares
        if rows is not None:
            sizes, sums, squares = sizes[rows], sums[rows], squares[rows]
        observed = (sizes * squares - (sums**2).sum(axis=1)) / (sizes - 1)
        count, total = sizes.sum(), sums.sum(axis=0)
        expected = (count * squares.sum() - total @ total) / (count - 1)
        return float(1 - observed.sum() / expected) if expected > 1e-12 * count else float("nan")


def alpha_interval(
    units: Any, values: Any, level: str, confidence: float, seed: int = 0
) -> ConfidenceInterval:
    """Alpha of answers with an interval by the bootstrap over units.

    Parameters
    ----------
    units : (answer,)
        What each is an answer to.
    values : (answer,)
        Names for "nominal", else numbers.
    level : str
        "nominal" (the same or not), "ordinal" (by ranks) or "interval" (by differences).
    confidence : float
        0.95, for example.
    seed : int
        Of the draws.

    Returns
    -------
    ConfidenceInterval
        NaN where no unit has two answers, where all answers are the same, and where there are
        more kinds of answers to more units than `CELLS_MAX`; NaN bounds for fewer than three units.
    """
    answered = _units(units, values, level)
    if answered is None:
        return NO_INTERVAL
    value, count = answered.alpha(), len(answered.sizes)
    rng = np.random.default_rng(seed)
    drawn = [
        answered.alpha(rng.integers(0, count, count)) for _ in range(DRAWS if count > 2 else 0)
    ]
    finite = [each for each in drawn if each == each]
    if not finite:
        return ConfidenceInterval(value, float("nan"), float("nan"))
    low, high = np.quantile(finite, [0.5 - confidence / 2, 0.5 + confidence / 2])
    return ConfidenceInterval(value, float(low), float(high))


def _units(units: Any, values: Any, level: str) -> _Units | None:
    unit, values = codes_of(units), np.asarray(values)
    kept = (np.bincount(unit) > 1)[unit] if len(unit) else np.zeros(0, bool)
    if not kept.any():
        return None
    unit, values = codes_of(unit[kept]), values[kept]
    sizes = np.bincount(unit).astype(np.float64)
    if level == "nominal":  # a name is a point on an axis of its own
        value = codes_of(values)
        kinds = int(value.max()) + 1
        if len(sizes) * kinds > CELLS_MAX:
            return None
        counts = np.bincount(unit * kinds + value, minlength=len(sizes) * kinds)
        return _Units(sizes, counts.reshape(-1, kinds).astype(np.float64), sizes)
    numbers = values.astype(np.float64)
    if level == "ordinal":  # the ordinal metric is the difference of middle ranks
        _, inverse, counts = np.unique(numbers, return_inverse=True, return_counts=True)
        numbers = (np.cumsum(counts) - counts / 2)[inverse]
    numbers = numbers - numbers.mean()
    sums, squares = (np.bincount(unit, each).astype(np.float64) for each in (numbers, numbers**2))
    return _Units(sizes, sums[:, None], squares)
