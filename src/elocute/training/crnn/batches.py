"""From clips to tensors: cut at random, degraded, padded and masked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from elocute.audio.mel_with_deltas import CONTEXT, HOP, MARGIN, RATE
from elocute.models.crnn_encoders import MEL
from elocute.models.crnn_network import OWN_COLUMN
from elocute.networks.crnn import SharedCrnn
from elocute.training.crnn.augment import degrade, interpolate_rows, random_tempo
from elocute.training.crnn.feature_cache import CachedClip, FeatureCache
from elocute.training.crnn.settings import CrnnTrainConfig

SPAN = 2 * (CONTEXT + MARGIN) + 1  # columns that one frame needs


@dataclass(frozen=True, eq=False)
class ClipBatch:
    """Clips of many lengths: convolutions run over all of them laid end to end, without padding.

    Parameters
    ----------
    static : (column, 128)
        Log-mel columns, or an encoder's, of all clips, one after another.
    starts : (window,)
        First columns of all windows in `static`.
    places : (clip, frame)
        The window of each frame, 0 where a clip has ended.
    targets : (clip, frame, parameter)
        Parameters.
    mask : (clip, frame)
        0 where a clip has ended (in the wild 2019, section 6.1).
    """

    static: Tensor
    starts: Tensor
    places: Tensor
    targets: Tensor
    mask: Tensor

    def to(self, device: torch.device) -> ClipBatch:
        return ClipBatch(*(value.to(device) for value in vars(self).values()))


def predict_batch(network: SharedCrnn, batch: ClipBatch) -> Tensor:
    """(clip, frame, parameter); the LSTM begins anew with every clip."""
    columns = network.crnn.columns_in_blocks(network.crnn.seen(batch.static[None]))
    embedded = network.embed_windows(columns, batch.starts[None])[0]
    return network.crnn.head(embedded[batch.places])[0]


def whole_batch(cache: FeatureCache, clips: Sequence[CachedClip]) -> ClipBatch:
    """Clips as they are, for validation and test."""
    parts = [
        (cache.columns(clip).astype(np.float32), cache.starts(clip), cache.parameters(clip))
        for clip in clips
    ]
    return _padded(parts)


def random_batch(
    cache: FeatureCache,
    clips: Sequence[CachedClip],
    config: CrnnTrainConfig,
    rng: np.random.Generator,
) -> ClipBatch:
    """Clips cut at both ends (section 6.4) and, as far as the settings say, degraded."""
    parts = []
    for index, clip in enumerate(clips):
        first, frames = random_segment(clip.frames, config, rng)
        if rng.random() < config.augment:
            other = cache.columns(clips[index - 1]).astype(np.float32)
            parts.append(_degraded(cache, clip, first, frames, other, rng))
            continue
        starts = cache.starts(clip, first, frames)
        begin, end = int(starts[0]), int(starts[-1]) + SPAN
        static = cache.columns(clip)[begin:end].astype(np.float32)
        parts.append((static, starts - begin, cache.parameters(clip)[first : first + frames]))
    return _padded(parts)


def random_segment(
    frames: int, config: CrnnTrainConfig, rng: np.random.Generator
) -> tuple[int, int]:
    """First frame and how many: at least `keep` of a clip, at most `frames_most`."""
    least = max(1, int(np.ceil(config.keep * frames)))
    kept = min(int(rng.integers(least, frames + 1)), config.frames_most)
    return int(rng.integers(0, frames - kept + 1)), kept


def _degraded(
    cache: FeatureCache,
    clip: CachedClip,
    first: int,
    frames: int,
    other: np.ndarray,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same frames at another tempo, by another voice, in another room."""
    rate = random_tempo(rng)
    count = max(1, int(frames / rate))
    columns = cache.columns(clip).astype(np.float32)
    # Window k begins at k · 100 / fps; its frame's own time is what is played faster.
    own = OWN_COLUMN[cache.encoder]
    middle = (clip.first + first) * (RATE / HOP) / cache.fps + own
    step = RATE / HOP / cache.fps
    starts = np.floor(np.arange(count) * step + 0.5).astype(np.int64)
    places = middle + (np.arange(starts[-1] + SPAN) - own) * rate
    static = interpolate_rows(columns, places)
    if cache.encoder == MEL:  # others learned to hear through rooms and noise themselves
        static = degrade(static, other, rng)
    targets = interpolate_rows(np.asarray(cache.parameters(clip)), first + np.arange(count) * rate)
    return static, starts, targets


def _padded(parts: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> ClipBatch:
    """Of columns, first columns of windows in them, and parameters, per clip."""
    frames, outputs = max(len(begin) for _, begin, _ in parts), parts[0][2].shape[1]
    places = np.zeros((len(parts), frames), np.int64)
    targets = np.zeros((len(parts), frames, outputs), np.float32)
    mask = np.zeros((len(parts), frames), np.float32)
    starts, columns, windows = [], 0, 0
    for index, (values, begin, wanted) in enumerate(parts):
        count = len(begin)
        starts.append(begin + columns)
        places[index, :count] = np.arange(windows, windows + count)
        targets[index, :count] = wanted
        mask[index, :count] = 1
        columns, windows = columns + len(values), windows + count
    static = np.concatenate([values for values, _, _ in parts])
    return ClipBatch(
        *map(torch.from_numpy, (static, np.concatenate(starts), places, targets, mask))
    )
