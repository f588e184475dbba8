"""The input of the second paper: 41 x 128 x 3 per video frame.

128 log-mel bands over 20 ms windows every 10 ms, 400 ms of them around each video frame, with
their first and second time derivatives (Tzirakis et al. 2019, section 3.2). Sound is taken at
44.1 kHz, its mean removed and its peak set to one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.audio.mel import hann, mel_filterbank, power_spectrum
from elocute.audio.waveform import Waveform

RATE = 44100
BANDS = 128
WINDOW, HOP, FFT = 882, 441, 1024
CONTEXT = 20  # frames of 10 ms on each side: 41 in all
FLOOR = 1e-10
SLOPE = np.arange(-2, 3) / 10.0  # the regression slope over five frames


def mel3_frames(waveform: Waveform) -> NDArray[np.float32]:
    """(frame, 128, 3): static, first and second derivative, frame t centred on t·10 ms."""
    samples = waveform.resample(RATE).samples.astype(np.float64)
    samples -= samples.mean()
    samples /= max(np.abs(samples).max(), 1e-9)
    power = power_spectrum(samples, hann(WINDOW), HOP, FFT)
    static = np.log(np.maximum(power @ mel_filterbank(RATE, FFT, BANDS).T, FLOOR))
    first = derivative(static)
    return np.stack([static, first, derivative(first)], axis=-1).astype(np.float32)


def derivative(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Slope over five frames, ends repeated: Σ n·(x[t+n] - x[t-n]) / (2 Σ n²), n = 1, 2."""
    padded = np.pad(values, ((2, 2), (0, 0)), mode="edge")
    return sum(slope * padded[k : k + len(values)] for k, slope in enumerate(SLOPE))  # type: ignore[return-value]


def mel3_windows(waveform: Waveform, fps: float = 30.0) -> NDArray[np.float32]:
    """(frame, 41, 128, 3), one per video frame at `fps`, centred on i / fps; ends repeated."""
    frames = mel3_frames(waveform)
    count = max(1, round(waveform.duration_s * fps))
    middles = np.round(np.arange(count) / fps * RATE / HOP).astype(int)
    taps = middles[:, None] + np.arange(-CONTEXT, CONTEXT + 1)
    return frames[np.clip(taps, 0, len(frames) - 1)]
