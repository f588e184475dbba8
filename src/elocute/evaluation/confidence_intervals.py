"""Confidence intervals over clips by the bootstrap (Efron 1979), the same for the same seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elocute.evaluation.metrics import AVERAGED_METRICS, ClipMetrics

DRAWS = 2000
CONFIDENCE = 0.95


@dataclass(frozen=True)
class ConfidenceInterval:
    """A value over all clips, and its 95 % confidence interval.

    Attributes
    ----------
    value, low, high : float
        In the measure's unit; NaN where there is no value.
    """

    value: float
    low: float
    high: float

    def record(self) -> dict[str, float] | None:
        """Numbers by name, for JSON; None where there is no value."""
        return None if self.value != self.value else vars(self).copy()


NO_INTERVAL = ConfidenceInterval(float("nan"), float("nan"), float("nan"))


def ratio_interval(
    above: Sequence[float], below: Sequence[float], seed: int = 0, draws: int = DRAWS
) -> ConfidenceInterval:
    """Σ above / Σ below over clips, with the clips resampled.

    Parameters
    ----------
    above, below : sequence of float
        Numerator and denominator of each clip; ones below give a mean.
    seed : int
        Seed of the bootstrap.
    draws : int
        Number of resampled sets of clips.

    Returns
    -------
    ConfidenceInterval
        `NO_INTERVAL` where there is no clip, a clip has no value, or nothing is counted. With one
        clip the bounds are its value.
    """
    top, bottom = np.asarray(above, np.float64), np.asarray(below, np.float64)
    if not len(top) or not np.isfinite(top).all() or bottom.sum() <= 0:
        return NO_INTERVAL
    rows = np.random.default_rng(seed).integers(0, len(top), (draws, len(top)))
    tops, bottoms = top[rows].sum(axis=1), bottom[rows].sum(axis=1)
    ratios = tops[bottoms > 0] / bottoms[bottoms > 0]
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(ratios, [tail, 1 - tail])
    return ConfidenceInterval(float(top.sum() / bottom.sum()), float(low), float(high))


def mean_interval(values: Sequence[float], seed: int = 0, draws: int = DRAWS) -> ConfidenceInterval:
    """The mean over clips with its confidence interval.

    Parameters
    ----------
    values : sequence of float
        One for each clip.
    seed, draws : int
        As for `ratio_interval`.

    Returns
    -------
    ConfidenceInterval
        `NO_INTERVAL` where a clip has no value.
    """
    return ratio_interval(values, [1.0] * len(values), seed, draws)


def metric_intervals(clips: Sequence[ClipMetrics], seed: int = 0) -> dict[str, ConfidenceInterval]:
    """Every metric over some clips: means, and closures pooled over clips.

    Parameters
    ----------
    clips : sequence of ClipMetrics
        Metrics of each clip.
    seed : int
        Seed of the bootstrap.

    Returns
    -------
    dict of str to ConfidenceInterval
        The metrics of `AVERAGED_METRICS`; `closure_recall`, the share of true closures that the
        prediction makes; `closure_precision`, the share of predicted closures that are true.
    """
    summary = {
        name: mean_interval([getattr(c, name) for c in clips], seed) for name in AVERAGED_METRICS
    }
    counted = [clip.closures for clip in clips if clip.closures is not None]
    recall = ratio_interval([c.met for c in counted], [c.wanted for c in counted], seed)
    precision = ratio_interval([c.right for c in counted], [c.made for c in counted], seed)
    return {**summary, "closure_recall": recall, "closure_precision": precision}
