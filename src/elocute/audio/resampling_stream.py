"""Resamples sound block by block."""

from __future__ import annotations

from typing import Any

import numpy as np

from elocute.array_types import Float32Array

RESAMPLING_S = 0.06
"""Resampling delays sound by no more than this."""


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
