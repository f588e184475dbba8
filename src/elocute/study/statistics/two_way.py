"""Means over people and stimuli that are both drawn from many: intervals by two-way clustering.

    V = V(people) + V(stimuli) − V(both)

(Cameron, Gelbach and Miller 2011), each of V with its correction for few clusters; Student's t with
as many degrees of freedom as the smaller side has members, less one.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import needs_extra
from elocute.evaluation.confidence_intervals import NO_INTERVAL, ConfidenceInterval


def codes_of(names: Any) -> NDArray[np.intp]:
    """Members as numbers from 0."""
    names = np.asarray(names)
    return np.unique(names, return_inverse=True)[1] if len(names) else np.zeros(0, np.intp)


def two_way_covariance(
    scores: NDArray[np.float64], people: NDArray[np.intp], stimuli: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Of the sum of rows of scores, where rows of one person or one stimulus go together.

    Parameters
    ----------
    scores : (row, column)
        Each row's part of the sum, its expectation 0.
    people, stimuli : (row,)
        Numbers from 0.

    Returns
    -------
    (column, column)
        Never less than that over people alone or stimuli alone.
    """
    both = people * (int(stimuli.max(initial=0)) + 1) + stimuli
    by_people, by_stimuli, by_both = (
        _clustered(scores, codes_of(codes)) for codes in (people, stimuli, both)
    )
    summed = by_people + by_stimuli - by_both
    floor = by_people if np.trace(by_people) >= np.trace(by_stimuli) else by_stimuli
    small = np.linalg.eigvalsh(summed - floor).min(initial=0.0) < 0
    return floor if small else summed


def _clustered(scores: NDArray[np.float64], codes: NDArray[np.intp]) -> NDArray[np.float64]:
    count = int(codes.max(initial=-1)) + 1
    sums = np.stack([np.bincount(codes, column, count) for column in scores.T], axis=1)
    small = count / (count - 1) if count > 1 else 1.0
    return np.asarray(sums.T @ sums * small, np.float64)


def degrees_of(people: NDArray[np.intp], stimuli: NDArray[np.intp]) -> int:
    """Of freedom: the smaller side's members less one; a side of one member is taken as fixed."""
    counts = [len(np.unique(each)) for each in (people, stimuli)]
    return max(min((count for count in counts if count > 1), default=1) - 1, 1)


def mean_over(
    values: Any, people: Any, stimuli: Any, confidence: float
) -> tuple[ConfidenceInterval, float]:
    """A mean with its interval over people and stimuli, and its standard error.

    Parameters
    ----------
    values : (row,)
        Answers as numbers.
    people, stimuli : (row,)
        Whose and of what.
    confidence : float
        0.95, for example.

    Returns
    -------
    interval : ConfidenceInterval
        NaN bounds for fewer than two people.
    error : float
        Standard error.
    """
    with needs_extra("a report", "study"):
        from scipy.stats import t
    values = np.asarray(values, np.float64)
    if not len(values):
        return NO_INTERVAL, float("nan")
    who, what = codes_of(people), codes_of(stimuli)
    mean = float(values.mean())
    if int(who.max()) < 1:
        return ConfidenceInterval(mean, float("nan"), float("nan")), float("nan")
    scores = (values - mean)[:, None] / len(values)
    error = float(np.sqrt(two_way_covariance(scores, who, what)[0, 0]))
    reach = float(t.ppf(0.5 + confidence / 2, degrees_of(who, what))) * error
    return ConfidenceInterval(mean, mean - reach, mean + reach), error
