"""Bradley and Terry's model: how strong each condition is, from all comparisons together.

logit P(left chosen) = strength(left) − strength(right) + side
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import needs_extra
from elocute.evaluation.confidence_intervals import ConfidenceInterval
from elocute.study.statistics.mixed_logit import logistic
from elocute.study.statistics.two_way import codes_of, degrees_of, two_way_covariance

RIDGE = 1e-4
"""Holds what always wins or always loses at a finite strength; others change by less than 1e-3."""
STEPS_MAX = 200


@dataclass(frozen=True)
class Strengths:
    """The fitted model."""

    names: tuple[str, ...]  # conditions
    values: NDArray[np.float64]  # (condition,) strengths in logits; their mean is 0
    covariance: NDArray[np.float64]  # (condition, condition) over people and stimuli
    side: float  # in logits: above 0 where the left is chosen more often whatever is there
    degrees: int  # of freedom

    def interval(self, name: str, confidence: float, against: str = "") -> ConfidenceInterval:
        """A strength, or how much it exceeds another's, in logits."""
        from scipy.stats import t

        weights = np.zeros(len(self.names))
        weights[self.names.index(name)] += 1
        if against:
            weights[self.names.index(against)] -= 1
        value = float(weights @ self.values)
        error = float(np.sqrt(max(weights @ self.covariance @ weights, 0.0)))
        reach = float(t.ppf(0.5 + confidence / 2, self.degrees)) * error
        return ConfidenceInterval(value, value - reach, value + reach)

    def p_value(self, name: str, against: str) -> float:
        """Of the hypothesis that two are equally strong."""
        from scipy.stats import t

        apart = self.interval(name, 0.5, against)
        error = (apart.high - apart.value) / float(t.ppf(0.75, self.degrees))
        return float(2 * t.sf(abs(apart.value) / error, self.degrees)) if error > 0 else 1.0


def connected(names: Sequence[str], left: Sequence[str], right: Sequence[str]) -> bool:
    """Whether every condition was compared with every other, be it by way of others."""
    parts = {name: {name} for name in names}
    for pair in set(zip(left, right, strict=True)):
        joined = parts[pair[0]] | parts[pair[1]]
        for name in joined:
            parts[name] = joined
    return len({id(part) for part in parts.values()}) <= 1


def fit_bradley_terry(
    left: Sequence[str],
    right: Sequence[str],
    chose_left: Any,
    people: Any,
    stimuli: Any,
    *,
    side: bool = True,
) -> Strengths | None:
    """Fit the model.

    Parameters
    ----------
    left, right : sequence of str
        Conditions of each comparison.
    chose_left : (row,)
        Whether the left was chosen.
    people, stimuli : (row,)
        Who answered, and what was said.
    side : bool
        Whether sides may matter.

    Returns
    -------
    Strengths, optional
        None where conditions were never compared, not by way of others either.

    Raises
    ------
    MachineError
        Where scipy is missing.
    """
    with needs_extra("a report", "study"):
        import scipy  # noqa: F401  for the intervals
    names = tuple(sorted({*left, *right}))
    if len(names) < 2 or not connected(names, left, right):
        return None
    place = {name: k for k, name in enumerate(names)}
    yes = np.asarray(chose_left, np.float64)
    rows, count = np.arange(len(yes)), len(names)
    signs = np.zeros((len(yes), count))
    signs[rows, [place[name] for name in left]] += 1
    signs[rows, [place[name] for name in right]] -= 1
    # Strengths add up to 0: as many columns as conditions, less one.
    basis = np.vstack([np.eye(count - 1), -np.ones(count - 1)])
    columns = signs @ basis
    if side:
        columns = np.column_stack([columns, np.ones(len(yes))])
    at, inverse = _newton(columns, yes)
    scores = (yes - logistic(columns @ at))[:, None] * columns
    who, what = codes_of(people), codes_of(stimuli)
    covariance = inverse @ two_way_covariance(scores, who, what) @ inverse
    inner = count - 1
    return Strengths(
        names,
        basis @ at[:inner],
        basis @ covariance[:inner, :inner] @ basis.T,
        float(at[inner]) if side else 0.0,
        degrees_of(who, what),
    )


def _newton(
    columns: NDArray[np.float64], yes: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    at = np.zeros(columns.shape[1])
    inverse = np.eye(len(at))
    for _ in range(STEPS_MAX):
        p = logistic(columns @ at)
        curve = columns.T @ ((p * (1 - p))[:, None] * columns) + RIDGE * np.eye(len(at))
        inverse = np.linalg.inv(curve)
        step = np.clip(inverse @ (columns.T @ (yes - p) - RIDGE * at), -1, 1)
        at = at + step
        if np.abs(step).max(initial=0.0) < 1e-10:
            break
    return np.asarray(at, np.float64), np.asarray(inverse, np.float64)
