"""How many people a comparison needs, by simulated studies, and by exact power beside them.

A simulated study has people and stimuli that differ, as the report's models have them, and answers
that lapse; its test is over people and stimuli (`two_way`). The exact power is that of the binomial
test, as if every answer came from another person: it is the least that can be hoped for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.errors import StudyError, needs_extra
from elocute.evaluation.confidence_intervals import ConfidenceInterval
from elocute.study.design.design import Design
from elocute.study.design.plan_settings import Plan
from elocute.study.design.trials import block_count, block_trials
from elocute.study.statistics.mixed_logit import marginal_share
from elocute.study.statistics.proportions import wilson_interval

PEOPLE_MAX = 5_000
CELLS_MAX = 4_000_000
"""Answers simulated at once."""
KINDS = ("binary", "style")


@dataclass(frozen=True)
class PlannedPower:
    """How often it is found with so many people."""

    people: int  # whose answers are judged; those that are excluded come on top
    power: ConfidenceInterval  # share of simulated studies that find it
    exact: float  # power of the binomial test, as if answers were independent


@dataclass(frozen=True)
class Planned:
    """A plan's result."""

    people: int  # how many are needed; 0 where no number is enough
    tried: list[PlannedPower]  # by number of people


def plan_for(design: Design, **changes: object) -> Plan:
    """A plan for a study's comparisons.

    Parameters
    ----------
    design : Design
        Of kind "binary" or "style".
    **changes
        Fields of `Plan` that are given otherwise.

    Returns
    -------
    Plan
        Its trials, stimuli, comparisons, margin and confidence are the study's.

    Raises
    ------
    StudyError
        For a study of another kind, and for values that do not fit.
    """
    if design.study.kind not in KINDS:
        raise StudyError.about(
            design.path,
            found=f"a study of kind {design.study.kind}",
            allowed=f"kind {' or '.join(KINDS)}",
            remedy="without a study, give `trials` and `stimuli`",
        )
    blocks = range(1, block_count(design) + 1)
    each = sum(len(block_trials(design, block)) for block in blocks) / len(blocks)
    pairs = len(design.pairs)
    settings = {
        "trials": max(1, round(each / pairs)),
        "stimuli": len(design.stimuli.names),
        "comparisons": pairs if design.analysis.correction != "none" else 1,
        "margin": design.analysis.margin,
        "confidence": design.analysis.confidence,
    }
    return Plan(**{**settings, **changes})  # type: ignore[arg-type]


def plan_study(plan: Plan) -> Planned:
    """The least number of people with which it is found often enough.

    Parameters
    ----------
    plan : Plan
        What is to be found.

    Returns
    -------
    Planned

    Raises
    ------
    StudyError
        For a preference that is none, or an equivalence that is a preference.
    MachineError
        Where scipy is missing.
    """
    plan.check()
    tried: dict[int, PlannedPower] = {}

    def enough(people: int) -> bool:
        if people not in tried:
            tried[people] = power_with(plan, people)
        return tried[people].power.value >= plan.power

    low, high = 3, 4
    while not enough(high):
        low, high = high, 2 * high
        if low >= PEOPLE_MAX:
            return Planned(0, [tried[n] for n in sorted(tried)])
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return Planned(high, [tried[n] for n in sorted(tried)])


def power_with(plan: Plan, people: int) -> PlannedPower:
    """How often it is found with so many people, two or more."""
    at_once = max(1, CELLS_MAX // (people * plan.trials))
    rng = np.random.default_rng([plan.seed, people])
    successes = done = 0
    while done < plan.simulations:
        count = min(at_once, plan.simulations - done)
        successes += int(_found(plan, people, count, rng).sum())
        done += count
    power = wilson_interval(successes, done, 0.95)
    return PlannedPower(people, power, exact_power(plan, people * plan.trials))


def exact_power(plan: Plan, answers: int) -> float:
    """Power of the exact binomial tests with so many independent answers."""
    with needs_extra("a plan", "study"):
        from scipy.stats import binom
    share = (1 - plan.lapses) * plan.share + plan.lapses / 2
    counts = np.arange(answers + 1)
    if plan.equivalent:
        above = binom.sf(counts - 1, answers, 0.5 - plan.margin) <= plan.level
        below = binom.cdf(counts, answers, 0.5 + plan.margin) <= plan.level
        finding = above & below
    else:
        finding = 2 * binom.cdf(np.minimum(counts, answers - counts), answers, 0.5) <= plan.level
    return float(binom.pmf(counts[finding], answers, share).sum())


def _found(plan: Plan, people: int, count: int, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Whether each of some simulated studies finds it."""
    from scipy.stats import t

    seen = (np.arange(people)[:, None] + np.arange(plan.trials)) % plan.stimuli
    logit = _logit_of(plan.share, float(np.hypot(plan.people_sd, plan.stimuli_sd)))
    of_people = plan.people_sd * rng.standard_normal((count, people))
    of_stimuli = plan.stimuli_sd * rng.standard_normal((count, plan.stimuli))
    eta = logit + of_people[:, :, None] + of_stimuli[:, seen]
    share = (1 - plan.lapses) * 0.5 * (1 + np.tanh(eta / 2)) + plan.lapses / 2
    chosen = (rng.random(eta.shape) < share).astype(np.float64)
    mean = chosen.mean(axis=(1, 2))
    apart = chosen - mean[:, None, None]
    error = np.sqrt(_variance(apart, seen, plan.stimuli)) / (people * plan.trials)
    sides = [each for each in (people, min(plan.stimuli, plan.trials * people)) if each > 1]
    degrees = max(min(sides) - 1, 1)
    if plan.equivalent:
        reach = float(t.ppf(1 - plan.level, degrees)) * error
        return (
            (error > 0) & (mean - reach >= 0.5 - plan.margin) & (mean + reach <= 0.5 + plan.margin)
        )
    reach = float(t.ppf(1 - plan.level / 2, degrees)) * error
    # Answers that are all alike have no error, and so few of them tell nothing.
    return (np.abs(mean - 0.5) > reach) & (error > 0)


def _variance(
    apart: NDArray[np.float64], seen: NDArray[np.intp], stimuli: int
) -> NDArray[np.float64]:
    """Of the sum of each study, as `two_way.two_way_covariance` has it."""
    count, people, trials = apart.shape
    by_people = (apart.sum(axis=2) ** 2).sum(axis=1) * people / (people - 1)
    which = np.zeros((people * trials, stimuli))
    which[np.arange(people * trials), seen.ravel()] = 1
    sums = apart.reshape(count, -1) @ which
    by_stimuli = (sums**2).sum(axis=1) * (stimuli / (stimuli - 1) if stimuli > 1 else 1.0)
    if stimuli == 1:
        return by_people
    cells = people * min(trials, stimuli)
    if trials <= stimuli:
        both = (apart**2).sum(axis=(1, 2))
    else:
        of_cells = np.zeros((count, people, stimuli))
        for place in range(trials):
            of_cells[:, np.arange(people), seen[:, place]] += apart[:, :, place]
        both = (of_cells**2).sum(axis=(1, 2))
    summed = by_people + by_stimuli - both * cells / (cells - 1)
    return np.maximum(summed, np.maximum(by_people, by_stimuli))


def _logit_of(share: float, sd: float) -> float:
    """The logit whose share over members who differ is this one."""
    low, high = -30.0, 30.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if marginal_share(middle, sd) < share else (low, middle)
    return (low + high) / 2
