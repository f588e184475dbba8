"""What the training loop reads: clips to train and to validate on, and their statistics."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.audio.mel_with_deltas import slopes
from elocute.errors import CorpusError
from elocute.training.crnn.feature_cache import CachedClip, FeatureCache
from elocute.training.crnn.loss import explained_shares
from elocute.training.crnn.settings import CrnnTrainConfig


@dataclass(frozen=True, eq=False)
class CrnnTrainingData:
    """What a training reads: clips to train on, and clips that choose the best epoch.

    shares (parameter,) are those of the variance that each parameter explains; they sum to one.
    """

    cache: FeatureCache
    train: Sequence[CachedClip]
    validation: Sequence[CachedClip]
    shares: torch.Tensor

    def __post_init__(self) -> None:
        if not self.train:
            raise CorpusError.about("shards", found="no clip in train", allowed="one or more")


def select_training_data(
    cache: FeatureCache,
    basis: np.ndarray,
    train: Sequence[CachedClip],
    validation: Sequence[CachedClip],
) -> CrnnTrainingData:
    """Training data of some clips of a cache; there may be none to validate on.

    basis: (component, vertex, 3) m, whose shapes weigh in the loss by what they move. Raises
    CorpusError without a clip to train on.
    """
    shares = explained_shares(torch.from_numpy(np.array(basis, np.float32)))
    return CrnnTrainingData(cache, train, validation, shares)


def training_clips(cache: FeatureCache, config: CrnnTrainConfig) -> list[CachedClip]:
    """The clips of the training part that a training learns from; CorpusError for none.

    With `captured` clips of captured speakers are among them; the paper learns from propagated
    parameters alone.
    """
    rows = [row for row in cache.select("train") if config.captured or row.carried]
    if not rows:
        carried = "" if config.captured else " that was carried over"
        raise CorpusError.about("shards", found=f"no clip in train{carried}", allowed="one or more")
    return rows


def channel_statistics(
    cache: FeatureCache, clips: Sequence[CachedClip], audible: Float32Array
) -> tuple[Float32Array, Float32Array]:
    """(3,) means and deviations of the three channels over some clips, in audible bands."""
    sums, squares, count = np.zeros(3), np.zeros(3), 0
    for clip in clips[:: max(1, len(clips) // 400)]:
        static = cache.columns(clip).astype(np.float32)[:, audible > 0]
        first = slopes(static)
        for channel, values in enumerate((static, first, slopes(first))):
            sums[channel] += float(values.mean(dtype=np.float64))
            squares[channel] += float(np.square(values, dtype=np.float64).mean())
        count += 1
    mean = sums / count
    deviation = np.sqrt(np.maximum(squares / count - mean**2, 1e-12))
    return mean.astype(np.float32), deviation.astype(np.float32)


def split_into_batches(
    clips: Sequence[CachedClip], size: int, order: NDArray[np.intp]
) -> Iterator[list[CachedClip]]:
    """Clips in the given order, the last batch smaller."""
    for start in range(0, len(order), size):
        yield [clips[index] for index in order[start : start + size]]
