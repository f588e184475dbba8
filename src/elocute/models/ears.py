"""Ears: sound of any rate, in blocks of any length, to rows of features."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.articulation.driver import posteriors_from_phones
from elocute.audio.phones import PHONES
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.encoder import FEATURE_RATE, Encoder
from elocute.encoders.phone_encoder import builtin_encoder

Array = NDArray[np.float32]
Phones = list[tuple[float, float, str]]
"""(start s, end s, ARPAbet phone)"""
RESAMPLING_S = 0.06
"""A change of sample rate holds sound back for no longer than this."""


class Resampled:
    """Samples at another rate, block by block; the same however the sound is cut."""

    def __init__(self, sample_rate: int, wanted: int) -> None:
        self._resampler: Any = None
        if sample_rate != wanted:
            import soxr

            self._resampler = soxr.ResampleStream(sample_rate, wanted, 1, dtype="float32")

    def push(self, samples: Array, *, last: bool = False) -> Array:
        """What is ready of these samples, all that is left with `last`."""
        samples = np.ascontiguousarray(samples, np.float32)
        if self._resampler is None:
            return samples
        return self._resampler.resample_chunk(samples, last=last)


class PhoneEar:
    """The built-in phone encoder: log-posteriors (row, 40) at 50 Hz."""

    name, rate = "phones", FEATURE_RATE

    def __init__(self, sample_rate: int) -> None:
        self._resampled = Resampled(sample_rate, SPEECH_RATE)
        self._stream = builtin_encoder().stream()

    @property
    def lookahead_s(self) -> float:
        """Rows come so much later than their own time."""
        return RESAMPLING_S + phone_lookahead_s()

    def push(self, samples: Array) -> Array:
        return self._stream.push(self._resampled.push(samples))

    def flush(self) -> Array:
        rest = self._stream.push(self._resampled.push(np.zeros(0, np.float32), last=True))
        return np.concatenate([rest, self._stream.flush()])


class KnownPhones:
    """Phones whose times are known: rows of the same kind, all at the end.

    Raises InputError at the end for a phone that there is not.
    """

    name, rate = "phones", FEATURE_RATE

    def __init__(self, sample_rate: int, phones: Phones) -> None:
        self._sample_rate, self._phones, self._samples = sample_rate, phones, 0

    def push(self, samples: Array) -> Array:
        self._samples += len(samples)
        return np.zeros((0, len(PHONES)), np.float32)

    def flush(self) -> Array:
        seconds = self._samples / self._sample_rate
        return posteriors_from_phones(self._phones, seconds, FEATURE_RATE)


class WholeEar:
    """An encoder that wants the whole sound first."""

    def __init__(self, sample_rate: int, encoder: Encoder) -> None:
        self._sample_rate, self._encoder = sample_rate, encoder
        self._blocks: list[Array] = []

    @property
    def name(self) -> str:
        return self._encoder.name

    @property
    def rate(self) -> float:
        return self._encoder.rate

    def push(self, samples: Array) -> Array:
        self._blocks.append(np.array(samples, np.float32))
        return np.zeros((0, self._encoder.feature_count), np.float32)

    def flush(self) -> Array:
        sound = Waveform(np.concatenate(self._blocks), self._sample_rate)
        return self._encoder(sound).values


def phone_lookahead_s() -> float:
    """How much sound after a row of phones the encoder waits for, a row included."""
    return builtin_encoder().lookahead_s + 1 / FEATURE_RATE
