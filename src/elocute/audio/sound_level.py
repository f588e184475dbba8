"""Mean and peak level of a recording, for networks that normalise by them."""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.mel_with_deltas import SILENT_PEAK
from elocute.audio.waveform import Waveform


def samples_level(samples: Float32Array) -> tuple[float, float]:
    """Mean and peak of samples (sample,); the peak of silence is infinite."""
    mean = np.float32(samples.mean(dtype=np.float64))
    peak = float(np.abs(samples - mean).max())
    return float(mean), peak if peak > SILENT_PEAK else float("inf")


def sound_level(sound: Waveform, rate: int) -> tuple[float, float]:
    """Mean and peak of a sound at the rate at which a network hears it."""
    return samples_level(sound.resample(rate).samples)
