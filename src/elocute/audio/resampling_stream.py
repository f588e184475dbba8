"""Resamples sound block by block."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

from elocute.array_types import Float32Array

RESAMPLING_S = 0.06
"""Resampling sound of 16 to 48 kHz delays it by no more than this."""
CROSSINGS = 24  # of the prompt filter's sinc on either side
CUTOFF, BETA = 0.96, 6.0  # share of the lower rate's band that passes; of its Kaiser window


class ResamplingStream:
    """Samples at another rate, block by block; the same however the sound is cut.

    A `prompt` stream waits for 2 ms of the lower rate instead of 40, for a filter that is less
    steep: what lies near the end of the band is weakened.
    """

    def __init__(self, sample_rate: int, wanted: int, *, prompt: bool = False) -> None:
        self._resampler: Any = None
        if sample_rate == wanted:
            return
        if prompt:
            self._resampler = _PromptResampler(sample_rate, wanted)
        else:
            import soxr

            self._resampler = soxr.ResampleStream(sample_rate, wanted, 1, dtype="float32")

    def push(self, samples: Float32Array, *, last: bool = False) -> Float32Array:
        """The resampled samples that are ready; with `last`, all that remain."""
        samples = np.ascontiguousarray(samples, np.float32)
        if self._resampler is None:
            return samples
        return self._resampler.resample_chunk(samples, last=last)


class _PromptResampler:
    """A short filter of linear phase, a row of taps for each place between two samples."""

    def __init__(self, sample_rate: int, wanted: int) -> None:
        common = math.gcd(sample_rate, wanted)
        self._up, self._down = wanted // common, sample_rate // common
        slower = min(1.0, wanted / sample_rate)
        self._reach = math.ceil(CROSSINGS / slower)
        self._taps = _windowed_sinc(self._up, self._reach, slower)
        self._kept = np.zeros(self._reach, np.float32)  # nothing is before the first sample
        self._first = -self._reach  # number of the first sample that is kept
        self._given = self._taken = 0

    def resample_chunk(self, samples: Float32Array, *, last: bool = False) -> Float32Array:
        self._taken += len(samples)
        behind = np.zeros(self._reach if last else 0, np.float32)
        self._kept = np.concatenate([self._kept, samples, behind])
        # Sample n of the result stands at n · down / up, and needs `reach` samples behind it.
        known = self._first + len(self._kept) - self._reach
        until = max(self._given, -(-min(known, self._taken) * self._up // self._down))
        if until == self._given:
            return np.zeros(0, np.float32)
        places = np.arange(self._given, until) * self._down
        starts, phases = places // self._up - self._reach + 1, places % self._up
        windows = np.lib.stride_tricks.sliding_window_view(self._kept, 2 * self._reach)
        heard = np.einsum("nt,nt->n", windows[starts - self._first], self._taps[phases])
        self._given = until
        used = until * self._down // self._up - self._reach - self._first
        self._kept, self._first = self._kept[used:], self._first + used
        return heard


@cache
def _windowed_sinc(phases: int, reach: int, slower: float) -> Float32Array:
    """(phase, 2 · reach) taps of a low pass for moments between two samples."""
    apart = np.arange(1 - reach, reach + 1) - np.arange(phases)[:, None] / phases
    window = np.i0(BETA * np.sqrt(np.clip(1 - (apart / reach) ** 2, 0, 1))) / np.i0(BETA)
    taps = np.sinc(CUTOFF * slower * apart) * window
    return (taps / taps.sum(axis=1, keepdims=True)).astype(np.float32)


@cache
def resampling_s(sample_rate: int, wanted: int, *, prompt: bool = False) -> float:
    """How much resampling delays sound of a rate at most, s, as measured on a second of silence."""
    if sample_rate == wanted:
        return 0.0
    stream = ResamplingStream(sample_rate, wanted, prompt=prompt)
    block = np.zeros(sample_rate // 100, np.float32)
    samples_out, late_s = 0, 0.0
    for number in range(1, 101):
        samples_out += len(stream.push(block))
        late_s = max(late_s, number * len(block) / sample_rate - samples_out / wanted)
    return late_s
