"""From clips to tensors: cut at random, degraded, padded and masked.

Clips are degraded by another voice, room and microphone, noise and tempo. Peaks are normalised
before, so loudness alone changes nothing. Noise adds power to the bands, room and microphone weigh
them, another vocal tract shifts them, another tempo moves columns apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from elocute.array_types import Float32Array
from elocute.audio.mel_with_deltas import BANDS, CONTEXT, FLOOR, HOP, MARGIN, RATE
from elocute.models.crnn_encoders import MEL
from elocute.models.crnn_network import OWN_COLUMN
from elocute.networks.crnn import SharedCrnn
from elocute.training.crnn.feature_cache import CachedClip, FeatureCache
from elocute.training.crnn.settings import CrnnTrainConfig

LOWEST = float(np.log(FLOOR))
TEMPO = (0.85, 1.2)
TRACT = (0.88, 1.14)
DB = float(np.log(10) / 10)  # of a natural logarithm of power


def random_tempo(rng: np.random.Generator) -> float:
    """How much faster a clip is played."""
    return float(np.exp(rng.uniform(*np.log(TEMPO))))


def interpolate_rows(values: NDArray[np.floating], places: NDArray[np.floating]) -> Float32Array:
    """(place, feature) linear between rows of (row, feature), held at both ends."""
    places = np.clip(places, 0, len(values) - 1)
    below = np.minimum(places.astype(np.intp), max(len(values) - 2, 0))
    above = np.minimum(below + 1, len(values) - 1)
    share = (places - below).astype(np.float32)[:, None]
    return np.asarray(values[below] * (1 - share) + values[above] * share, np.float32)


def degrade(static: Float32Array, other: Float32Array, rng: np.random.Generator) -> Float32Array:
    """(column, 128) log-mel bands degraded at random; `other` is other speech, for babble."""
    bands = np.arange(BANDS)
    static = interpolate_rows(static.T, bands * np.exp(rng.uniform(*np.log(TRACT)))).T
    static = static + _curve(rng, 6.0)
    if rng.random() < 0.3:
        static = _limited(static, rng)
    power = np.exp(static)
    if rng.random() < 0.7:
        power = power + _noise(power, other, rng)
    # As if the peak that was normalised were elsewhere: a cough, a louder word.
    level = rng.uniform(-10, 3) * DB
    return np.maximum(np.log(power + 1e-12) + level, LOWEST).astype(np.float32)


def _curve(rng: np.random.Generator, most_db: float) -> Float32Array:
    """(128,) a microphone's and a room's colour: slow waves over the bands."""
    x = np.linspace(0, 1, BANDS)
    waves = [np.cos(np.pi * (k * x + rng.random() * 2)) / k for k in (1, 2, 3, 5)]
    sizes = rng.uniform(-most_db, most_db, len(waves)) * DB
    return np.asarray(sizes @ np.array(waves), np.float32)


def _limited(static: Float32Array, rng: np.random.Generator) -> Float32Array:
    """As over a telephone: little below or above a band."""
    bands = np.arange(BANDS)
    top, low = rng.uniform(55, 100), rng.uniform(0, 12)
    slope = rng.uniform(0.5, 4) * DB
    loss = slope * (np.maximum(bands - top, 0) + np.maximum(low - bands, 0))
    return static - loss.astype(np.float32)


def _noise(power: Float32Array, other: Float32Array, rng: np.random.Generator) -> Float32Array:
    """(column, 128) power of noise, 0 to 35 dB below the speech."""
    count = len(power)
    if rng.random() < 0.3:
        again = np.resize(np.roll(np.exp(other[::-1]), rng.integers(len(other)), 0), (count, BANDS))
        noise = again + np.roll(again, count // 3, 0)
    else:
        colour = np.exp(_curve(rng, 12.0) - rng.uniform(0, 0.06) * np.arange(BANDS))
        flicker = rng.gamma(3.0, 1 / 3, (count, BANDS)).astype(np.float32)
        swell = 1 + 0.8 * np.sin(np.arange(count) * rng.uniform(0.01, 0.3))[:, None]
        noise = colour * flicker * (swell if rng.random() < 0.3 else 1)
    ratio = power.mean() / max(float(noise.mean()), 1e-20)
    return (noise * ratio * 10 ** (-rng.uniform(0, 35) / 10)).astype(np.float32)


SPAN = 2 * (CONTEXT + MARGIN) + 1  # columns that one frame needs


@dataclass(frozen=True, eq=False)
class ClipBatch:
    """Clips of many lengths: convolutions run over all of them laid end to end, without padding.

    static: (column, 128) log-mel columns, or an encoder's, of all clips. starts: (window,), first
    columns of all windows in `static`. places: (clip, frame), the window of each frame, 0 where a
    clip has ended. targets: (clip, frame, parameter). mask: (clip, frame), 0 where a clip has ended
    (in the wild 2019, section 6.1).
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
