"""Concordance over clips, with confidence intervals, as in Table 2 of Tzirakis et al. 2019."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.errors import CorpusError
from elocute.evaluation.confidence_intervals import DRAWS, ConfidenceInterval, bootstrap_interval

FIRST = 5  # parameters that the paper's table names one by one
TINY = 1e-12


@dataclass(frozen=True)
class ConcordanceScore:
    """ρc over all frames of some clips together, with confidence intervals over clips.

    mean: over all parameters; the paper's µ28 where there are 28. weighted: by the variance that
    each parameter explains, as in the loss. first: of the first `FIRST` parameters, as the paper's
    table has them.
    """

    clips: int
    frames: int
    mean: ConfidenceInterval
    weighted: ConfidenceInterval
    first: tuple[ConfidenceInterval, ...]

    def record(self) -> dict[str, object]:
        """Numbers by name, for JSON."""
        return {
            "clips": self.clips,
            "frames": self.frames,
            "mean": self.mean.record(),
            "weighted": self.weighted.record(),
            **{f"c{i}": interval.record() for i, interval in enumerate(self.first, 1)},
        }


def score_concordance(
    predicted: Sequence[Float32Array],
    true: Sequence[Float32Array],
    shares: NDArray[np.floating],
    seed: int = 0,
) -> ConcordanceScore:
    """Concordance of predicted with true parameters, (frame, parameter) without unit for each clip.

    shares: (parameter,) share of the variance that each explains; need not add up to 1. seed: of
    the bootstrap. Raises CorpusError for no clip.
    """
    if not predicted:
        raise CorpusError.about("measure", found="no clip", allowed="one or more")
    sums = np.stack([_sums(x, y) for x, y in zip(predicted, true, strict=True)])
    rows = np.random.default_rng(seed).integers(0, len(sums), (DRAWS, len(sums)))
    # How often each clip is drawn, so that one product gives all draws.
    counts = np.stack([np.bincount(row, minlength=len(sums)) for row in rows]).astype(float)
    drawn = _concordance(np.tensordot(counts, sums, 1))
    value = _concordance(sums.sum(axis=0)[None])[0]
    weights = np.asarray(shares, float) / np.sum(shares)
    return ConcordanceScore(
        len(sums),
        int(sums[:, 0, 0].sum()),
        bootstrap_interval(value.mean(), drawn.mean(axis=1)),
        bootstrap_interval(value @ weights, drawn @ weights),
        tuple(bootstrap_interval(value[i], drawn[:, i]) for i in range(min(FIRST, len(value)))),
    )


def _sums(x: Float32Array, y: Float32Array) -> NDArray[np.float64]:
    """(6, parameter): frames, Σx, Σy, Σx², Σy², Σxy of one clip."""
    a, b = np.asarray(x, np.float64), np.asarray(y, np.float64)
    return np.stack([part.sum(axis=0) for part in (np.ones_like(a), a, b, a * a, b * b, a * b)])


def _concordance(sums: NDArray[np.float64]) -> NDArray[np.float64]:
    """(draw, parameter) ρc of sums (draw, 6, parameter)."""
    count, x, y, xx, yy, xy = np.moveaxis(sums, 1, 0)
    mean_x, mean_y = x / count, y / count
    var_x, var_y = xx / count - mean_x**2, yy / count - mean_y**2
    covariance = xy / count - mean_x * mean_y
    return 2 * covariance / (var_x + var_y + (mean_x - mean_y) ** 2 + TINY)
