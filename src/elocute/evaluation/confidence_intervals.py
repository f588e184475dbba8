"""Confidence intervals over clips by the bootstrap (Efron 1979), the same for the same seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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


def bootstrap_interval(value: float, draws: NDArray[np.float64]) -> ConfidenceInterval:
    """A value with the quantiles of its bootstrap, (draw,)."""
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(draws, [tail, 1 - tail])
    return ConfidenceInterval(float(value), float(low), float(high))


def ratio_interval(
    above: Sequence[float], below: Sequence[float], seed: int = 0, draws: int = DRAWS
) -> ConfidenceInterval:
    """Σ above / Σ below over clips, with the clips resampled `draws` times.

    `NO_INTERVAL` where there is no clip, a clip has no value, or nothing is counted. With one clip
    the bounds are its value.
    """
    top, bottom = np.asarray(above, np.float64), np.asarray(below, np.float64)
    if not len(top) or not np.isfinite(top).all() or bottom.sum() <= 0:
        return NO_INTERVAL
    rows = np.random.default_rng(seed).integers(0, len(top), (draws, len(top)))
    tops, bottoms = top[rows].sum(axis=1), bottom[rows].sum(axis=1)
    ratios = tops[bottoms > 0] / bottoms[bottoms > 0]
    return bootstrap_interval(float(top.sum() / bottom.sum()), ratios)


def mean_interval(values: Sequence[float], seed: int = 0, draws: int = DRAWS) -> ConfidenceInterval:
    """The mean over clips with its confidence interval; `NO_INTERVAL` where a clip has no value.

    Parameters
    ----------
    values : sequence of float
        One for each clip.
    seed, draws : int
        Seed of the bootstrap, and number of resampled sets of clips.

    Returns
    -------
    ConfidenceInterval
    """
    return ratio_interval(values, [1.0] * len(values), seed, draws)


def metric_intervals(clips: Sequence[ClipMetrics], seed: int = 0) -> dict[str, ConfidenceInterval]:
    """Every metric of `AVERAGED_METRICS` over some clips, closures and silence pooled over clips.

    `closure_recall` is the share of true closures that the prediction makes, `closure_precision`
    the share of predicted closures that are true; `lip_leak` and `true_lip_leak` the shares of
    silence in which predicted and true lips move.
    """
    summary = {
        name: mean_interval([getattr(c, name) for c in clips], seed) for name in AVERAGED_METRICS
    }
    counted = [clip.closures for clip in clips if clip.closures is not None]
    recall = ratio_interval([c.met for c in counted], [c.wanted for c in counted], seed)
    precision = ratio_interval([c.right for c in counted], [c.made for c in counted], seed)
    heard = [clip.silence for clip in clips if clip.silence is not None]
    silent = [each.silent for each in heard]
    return {
        **summary,
        "closure_recall": recall,
        "closure_precision": precision,
        "lip_leak": ratio_interval([each.moving for each in heard], silent, seed),
        "true_lip_leak": ratio_interval([each.true_moving for each in heard], silent, seed),
    }
