"""Confidence intervals by drawing clips again (Efron 1979), always the same for one seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elocute.evaluation.metrics import AVERAGED_METRICS, ClipMetrics

DRAWS = 2000
CONFIDENCE = 0.95


@dataclass(frozen=True)
class ConfidenceInterval:
    """A value over all clips and the bounds between which it lies with 95 % confidence."""

    value: float
    low: float
    high: float

    def record(self) -> dict[str, float] | None:
        """For JSON; None where there is no value."""
        return None if self.value != self.value else vars(self).copy()


NO_INTERVAL = ConfidenceInterval(float("nan"), float("nan"), float("nan"))


def ratio_interval(
    above: Sequence[float], below: Sequence[float], seed: int = 0, draws: int = DRAWS
) -> ConfidenceInterval:
    """Σ above / Σ below over clips, clips drawn again with what belongs to them.

    NOTHING where nothing is counted. A mean is the ratio to ones. One clip has no interval:
    low and high are its value.
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
    """The mean over clips; NOTHING where one of them has no value."""
    return ratio_interval(values, [1.0] * len(values), seed, draws)


def metric_intervals(clips: Sequence[ClipMetrics], seed: int = 0) -> dict[str, ConfidenceInterval]:
    """Every metric over some clips: means, and closures pooled.

    closure_recall     share of true closures that the prediction meets
    closure_precision  share of predicted closures that are true
    """
    summary = {
        name: mean_interval([getattr(c, name) for c in clips], seed) for name in AVERAGED_METRICS
    }
    counted = [clip.closures for clip in clips if clip.closures is not None]
    recall = ratio_interval([c.met for c in counted], [c.wanted for c in counted], seed)
    precision = ratio_interval([c.right for c in counted], [c.made for c in counted], seed)
    return {**summary, "closure_recall": recall, "closure_precision": precision}
