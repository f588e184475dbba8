"""Choices between two, by a logistic model in which people and stimuli are drawn from many.

    logit P(yes) = fixed · β + Σ over groups of a value for the group's member, N(0, σ²)

fitted by maximum likelihood, the members' values integrated out by Laplace's approximation, as
lme4's `glmer` does (Bates et al. 2015). The variational fit of statsmodels gives intervals that are
too narrow for a study (docs/measurements/study.md), so the model stands here, tested against both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import needs_extra

SD_MIN, SD_MAX = 1e-3, 20.0
"""Of the members of a group, in logits."""
STEPS_MAX = 100
EFFECT_MAX = 15.0
"""Logits beyond which an answer is certain: nothing larger can be told from it."""


@dataclass(frozen=True)
class MixedLogit:
    """A fitted model."""

    effects: NDArray[np.float64]  # (effect,) β in logits
    covariance: NDArray[np.float64]  # (effect, effect) of the effects
    sds: dict[str, float]  # how far the members of each group differ, σ in logits
    log_likelihood: float  # by Laplace's approximation
    # Of freedom, for intervals of the effects: few members tell little of how members differ.
    degrees: float
    converged: bool  # whether the search came to an end

    @property
    def errors(self) -> NDArray[np.float64]:
        """Standard errors of the effects."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def interval(self, effect: int, confidence: float) -> tuple[float, float]:
        """Where an effect lies, in logits, with this confidence."""
        from scipy.stats import t

        reach = float(t.ppf(0.5 + confidence / 2, self.degrees) * self.errors[effect])
        return float(self.effects[effect] - reach), float(self.effects[effect] + reach)

    def p_value(self, effect: int) -> float:
        """Of the hypothesis that an effect is none, two-sided."""
        from scipy.stats import t

        error = float(self.errors[effect])
        if not error > 0:
            return float("nan")
        return float(2 * t.sf(abs(self.effects[effect]) / error, self.degrees))


def fit_mixed_logit(
    yes: NDArray[np.floating],
    fixed: NDArray[np.floating],
    groups: Mapping[str, Sequence[Any] | NDArray[Any]],
    trials: NDArray[np.floating] | None = None,
    *,
    penalised: bool = True,
) -> MixedLogit:
    """Fit the model.

    Parameters
    ----------
    yes : (row,)
        How often it was yes: 0 or 1, or up to `trials`.
    fixed : (row, effect)
        What effects are multiplied with; a column of ones is the intercept.
    groups : mapping of str to sequence
        Each row's member by group: who answered, what was seen.
    trials : (row,), optional
        Answers in each row; ones by default.
    penalised : bool
        Whether deviations are kept from 0 by log σ (Chung et al. 2013): of few members, the
        likelihood often has it that none differs from another, and intervals are then too narrow.
        Without it the fit is that of lme4.

    Returns
    -------
    MixedLogit

    Raises
    ------
    MachineError
        Where scipy is missing.
    """
    with needs_extra("a report", "study"):
        from scipy.optimize import minimize

    problem = _Problem(yes, fixed, groups, trials, penalised)
    start = np.concatenate([problem.start(), np.full(len(problem.sizes), np.log(0.5))])
    effects = problem.fixed.shape[1]
    bounds = [(-EFFECT_MAX, EFFECT_MAX)] * effects
    bounds += [(np.log(SD_MIN), np.log(SD_MAX))] * len(problem.sizes)
    minimum = minimize(problem.deviance, start, jac=True, method="L-BFGS-B", bounds=bounds)
    at = np.asarray(minimum.x)
    sds = dict(zip(groups, np.exp(at[effects:]).tolist(), strict=True))
    covariance = problem.covariance(at)
    return MixedLogit(
        at[:effects],
        covariance,
        sds,
        -0.5 * float(minimum.fun),
        problem.degrees(sds, covariance),
        bool(minimum.success),
    )


class _Problem:
    """The likelihood. Members of the largest group are eliminated one by one, the rest together."""

    def __init__(
        self, yes: Any, fixed: Any, groups: Mapping[str, Any], trials: Any, penalised: bool
    ) -> None:
        self.penalised = penalised
        self.yes = np.asarray(yes, np.float64)
        self.fixed = np.asarray(fixed, np.float64)
        self.trials = np.ones(len(self.yes)) if trials is None else np.asarray(trials, np.float64)
        codes = [np.unique(np.asarray(each), return_inverse=True)[1] for each in groups.values()]
        self.sizes = [int(each.max()) + 1 if len(each) else 0 for each in codes]
        order = np.argsort([-size for size in self.sizes], kind="stable")
        self.order = order.tolist()
        starts = np.concatenate([[0], np.cumsum([self.sizes[k] for k in self.order])])
        self.count = int(starts[-1])
        self.places = [codes[k] + starts[row] for row, k in enumerate(self.order)]
        self.first = self.sizes[self.order[0]] if self.order else 0
        self.values = np.zeros(self.count)

    def start(self) -> NDArray[np.float64]:
        """Effects as if nobody differed, by a few steps of Newton."""
        at = np.zeros(self.fixed.shape[1])
        for _ in range(25):
            p = logistic(np.clip(self.fixed @ at, -EFFECT_MAX, EFFECT_MAX))
            weight = np.maximum(self.trials * p * (1 - p), 1e-9)
            curve = self.fixed.T @ (weight[:, None] * self.fixed) + 1e-6 * np.eye(len(at))
            step = np.linalg.solve(curve, self.fixed.T @ (self.yes - self.trials * p))
            at = np.clip(at + np.clip(step, -2, 2), -EFFECT_MAX / 2, EFFECT_MAX / 2)
            if np.abs(step).max(initial=0.0) < 1e-8:
                break
        return at

    def deviance(self, at: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        """−2 log-likelihood, with its penalty, and its slope by differences."""
        middle = self._deviance(at)
        steps = 1e-5 * np.eye(len(at))
        return middle, np.array([(self._deviance(at + step) - middle) / 1e-5 for step in steps])

    def _deviance(self, at: NDArray[np.float64]) -> float:
        effects = self.fixed.shape[1]
        scale = np.repeat(np.exp(at[effects:])[self.order], [self.sizes[k] for k in self.order])
        base = self.fixed @ at[:effects]
        values, step = self.values, np.zeros(self.count)
        fit, determinant = np.inf, 0.0
        for _ in range(STEPS_MAX):
            eta = base + sum((scale * values)[place] for place in self.places)
            now = self._loss(eta) + float(values @ values)
            if now > fit + 1e-9:  # Newton went too far
                step = step / 2
                values = values - step
                continue
            fit, p = now, logistic(eta)
            slope = scale * self._by_member(self.yes - self.trials * p) - values
            step, determinant = self._solve(self.trials * p * (1 - p), scale, slope)
            if np.abs(step).max(initial=0.0) < 1e-7:
                break
            values = values + step
        self.values = values  # the next search begins here
        penalty = -2 * float(at[effects:].sum()) if self.penalised else 0.0
        return fit + determinant + penalty

    def _loss(self, eta: NDArray[np.float64]) -> float:
        return -2 * float(self.yes @ eta - self.trials @ np.logaddexp(0, eta))

    def _by_member(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        sums = np.zeros(self.count)
        for place in self.places:
            sums += np.bincount(place, rows, self.count)
        return sums

    def _solve(
        self, weight: NDArray[np.float64], scale: NDArray[np.float64], slope: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], float]:
        """H⁻¹ slope and log |H|, H = I + scale Zᵀ W Z scale."""
        first, rest = self.first, self.count - self.first
        diagonal = 1 + scale**2 * self._by_member(weight)
        if not rest:
            return slope / diagonal, float(np.log(diagonal).sum())
        cross = np.zeros((first, rest))
        inner = np.diag(diagonal[first:])
        for k, place in enumerate(self.places[1:]):
            flat = self.places[0] * rest + place - first
            cross += np.bincount(flat, weight, first * rest).reshape(first, rest)
            for other in self.places[k + 2 :]:
                both = np.bincount((place - first) * rest + other - first, weight, rest * rest)
                block = both.reshape(rest, rest) * np.outer(scale[first:], scale[first:])
                inner += block + block.T
        cross *= np.outer(scale[:first], scale[first:])
        top = diagonal[:first]
        small = inner - cross.T @ (cross / top[:, None])
        low = np.linalg.solve(small, slope[first:] - cross.T @ (slope[:first] / top))
        high = (slope[:first] - cross @ low) / top
        return np.asarray(np.concatenate([high, low]), np.float64), float(
            np.log(top).sum() + np.linalg.slogdet(small)[1]
        )

    def covariance(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Of the effects: from the curvature of the likelihood over effects and deviations."""
        effects, count = self.fixed.shape[1], len(at)
        # A deviation at its bound has no curvature to speak of: it is taken as known.
        free = [k for k in range(count) if k < effects or at[k] > np.log(10 * SD_MIN)]
        steps = 1e-2 * np.eye(count)[free]
        middle = self._deviance(at)
        curve = np.zeros((len(free), len(free)))
        for row, one in enumerate(steps):
            curve[row, row] = self._deviance(at + one) + self._deviance(at - one) - 2 * middle
            for column, other in enumerate(steps[:row]):
                same = self._deviance(at + one + other) + self._deviance(at - one - other)
                turned = self._deviance(at + one - other) + self._deviance(at - one + other)
                curve[row, column] = curve[column, row] = (same - turned) / 4
        curve *= 0.5 / 1e-4
        covariance = np.linalg.pinv(curve)
        if (np.diag(covariance)[:effects] <= 0).any():
            covariance = np.linalg.pinv(curve[:effects, :effects])
        return np.asarray(covariance[:effects, :effects], np.float64)

    def degrees(self, sds: Mapping[str, float], covariance: NDArray[np.float64]) -> float:
        """By Satterthwaite: each group's part of the first effect's variance, from its members."""
        total = float(covariance[0, 0]) if len(covariance) else 0.0
        parts = [sd**2 / size for sd, size in zip(sds.values(), self.sizes, strict=True)]
        below = sum(
            part**2 / max(size - 1, 1) for part, size in zip(parts, self.sizes, strict=True)
        )
        below += max(total - sum(parts), 0.0) ** 2 / max(len(self.yes) - 1, 1)
        return float(np.clip(max(total, sum(parts)) ** 2 / below, 1, 1e6)) if below > 0 else 1e6


def logistic(eta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shares of logits."""
    return 0.5 * (1 + np.tanh(eta / 2))


def marginal_share(logit: float, sd: float) -> float:
    """The share of yes over all members, whose logits deviate from one by `sd`."""
    places, weights = np.polynomial.hermite_e.hermegauss(41)
    return float(logistic(logit + sd * places) @ weights / weights.sum())
