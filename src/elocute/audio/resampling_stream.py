"""Resamples sound block by block."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from elocute.array_types import Float32Array

RESAMPLING_S = 0.06
"""Resampling sound of 16 to 48 kHz delays it by no more than this."""


class ResamplingStream:
    """Samples at another rate, block by block; the same however the sound is cut."""

    def __init__(self, sample_rate: int, wanted: int) -> None:
        self._resampler: Any = None
        if sample_rate != wanted:
            import soxr

            self._resampler = soxr.ResampleStream(sample_rate, wanted, 1, dtype="float32")

    def push(self, samples: Float32Array, *, last: bool = False) -> Float32Array:
        """The resampled samples that are ready; with `last`, all that remain."""
        samples = np.ascontiguousarray(samples, np.float32)
        if self._resampler is None:
            return samples
        return self._resampler.resample_chunk(samples, last=last)


@cache
def resampling_s(sample_rate: int, wanted: int) -> float:
    """How much resampling delays sound of a rate at most, s, as measured on a second of silence."""
    if sample_rate == wanted:
        return 0.0
    stream, block = ResamplingStream(sample_rate, wanted), np.zeros(sample_rate // 100, np.float32)
    samples_out, late_s = 0, 0.0
    for number in range(1, 101):
        samples_out += len(stream.push(block))
        late_s = max(late_s, number * len(block) / sample_rate - samples_out / wanted)
    return late_s
