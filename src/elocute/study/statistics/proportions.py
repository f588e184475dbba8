"""Shares of answers: Wilson's interval, exact binomial tests, equivalence, corrections for many.

They take answers as independent of each other, which those of one person are not quite; the mixed
models (`mixed_logit`) and intervals over people and stimuli (`two_way`) are beside them for that.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from elocute.errors import needs_extra
from elocute.evaluation.confidence_intervals import NO_INTERVAL, ConfidenceInterval


def wilson_interval(count: int, total: int, confidence: float) -> ConfidenceInterval:
    """A share with Wilson's score interval (Wilson 1927); NaN where there is no answer."""
    if not total:
        return NO_INTERVAL
    with needs_extra("a report", "study"):
        from scipy.stats import binomtest
    interval = binomtest(count, total).proportion_ci(confidence, "wilson")
    return ConfidenceInterval(count / total, float(interval.low), float(interval.high))


def binomial_p(count: int, total: int, share: float = 0.5, alternative: str = "two-sided") -> float:
    """The p-value of the exact binomial test (Clopper and Pearson's tail sums) against a share.

    `alternative` is "two-sided", "greater" or "less". NaN where there is no answer.
    """
    if not total:
        return float("nan")
    with needs_extra("a report", "study"):
        from scipy.stats import binomtest
    return float(binomtest(count, total, share, alternative).pvalue)


def equivalence_p(count: int, total: int, margin: float, share: float = 0.5) -> float:
    """Two one-sided exact tests: whether a share differs from another by less than a margin.

    The greater of the two p-values: small where the share is surely within the margin.
    """
    low, high = max(share - margin, 0.0), min(share + margin, 1.0)
    return max(binomial_p(count, total, low, "greater"), binomial_p(count, total, high, "less"))


METHODS = {"holm": "holm", "bonferroni": "bonferroni", "benjamini-hochberg": "fdr_bh"}


def corrected(p_values: Sequence[float], correction: str) -> list[float]:
    """p-values of several tests, corrected for their number by one of `design.CORRECTIONS`.

    "holm" and "bonferroni" for the chance of any false finding, "benjamini-hochberg" for the share
    of false ones among findings. A test that could not be made is NaN and does not count.
    """
    values = np.asarray(p_values, np.float64)
    tested = np.isfinite(values)
    if correction == "none" or not tested.any():
        return values.tolist()
    with needs_extra("a report", "study"):
        from statsmodels.stats.multitest import multipletests
    values = values.copy()
    values[tested] = multipletests(values[tested], method=METHODS[correction])[1]
    return values.tolist()
