"""The front end of the speech encoder: log-mel energies relative to a running mean.

Everything is causal and block-wise, so a stream gives exactly what a whole file gives. Dividing
each band by its own slow mean takes away level, microphone and steady noise alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.audio.waveform import SPEECH_RATE
from elocute.numerics.mel import mel_points, triangles
from elocute.numerics.windows import hann

HOP = 160  # 10 ms
WINDOW = 400  # 25 ms
FFT = 512
BANDS = 64
LOWEST_HZ, HIGHEST_HZ = 40.0, 7800.0
FLOOR = 1e-11  # mean power of a band that counts as silence: -110 dB of full scale
MEAN_S = 6.0  # time constant of the running mean
PRIOR = 1e-6  # mean power expected before the sound begins
PRIOR_S = 0.1  # and how much sound that expectation counts for
SCALE = 1 / 3.0
LIMIT = 3.0  # features lie within ±LIMIT
BLOCK = 64  # frames for which the recursion is one matrix product

LOOKAHEAD_S = WINDOW / 2 / SPEECH_RATE
"""Frame t is centred on t·10 ms and sees half a window further."""


def mel_weights() -> NDArray[np.float32]:
    """(257, 64) triangular HTK-mel filters, each of area one."""
    return unit_triangles(mel_points(LOWEST_HZ, HIGHEST_HZ, BANDS + 2))


def unit_triangles(edges_hz: NDArray[np.float64]) -> NDArray[np.float32]:
    """(257, band) filters with corners at `edges_hz` (band + 2,), each of area one."""
    filters = np.ascontiguousarray(
        triangles(edges_hz * FFT / SPEECH_RATE, np.arange(FFT // 2 + 1)).T
    )
    return (filters / (filters.sum(axis=0) + 1e-6)).astype(np.float32)


def power_scale() -> float:
    """Brings |FFT|² to mean power, so that a full-scale sine is near 0 dB in its band."""
    return 1.0 / float(hann(WINDOW).sum() ** 2 / 4)


@dataclass
class _State:
    mean: NDArray[np.float64]  # Σ decay^(t-i)·power_i, prior included
    weight: float  # Σ decay^(t-i), prior included


class FrontEnd:
    """Samples in, features out; `flush` ends the sound.

    Frames are (frame, 64) float32, frame t centred on sample 160·t. A sound of n samples gives
    ceil(n / 160) frames, however it is cut into pieces.
    """

    def __init__(self) -> None:
        self._window = hann(WINDOW).astype(np.float32)
        self._mel = mel_weights() * np.float32(power_scale())
        self._pending = np.zeros(WINDOW // 2, np.float32)
        self._samples = self._frames = 0
        decay = float(np.exp(-HOP / SPEECH_RATE / MEAN_S))
        steps = np.arange(BLOCK)
        self._powers = decay ** (steps + 1)
        self._lower = np.tril(decay ** np.maximum(steps[:, None] - steps, 0))
        prior = PRIOR_S * SPEECH_RATE / HOP
        self._state = _State(np.full(BANDS, PRIOR * prior), prior)

    def push(self, samples: NDArray[np.float32]) -> NDArray[np.float32]:
        """Features of every frame whose window is now complete."""
        samples = np.asarray(samples, np.float32)
        self._samples += len(samples)
        self._pending = np.concatenate([self._pending, samples])
        return self._take(max(0, (len(self._pending) - WINDOW) // HOP + 1))

    def flush(self) -> NDArray[np.float32]:
        """The last frames, silence behind them."""
        left = -(-self._samples // HOP) - self._frames
        self._pending = np.concatenate([self._pending, np.zeros(WINDOW + HOP, np.float32)])
        return self._take(max(0, left))

    def _take(self, count: int) -> NDArray[np.float32]:
        if not count:
            return np.zeros((0, BANDS), np.float32)
        views = np.lib.stride_tricks.sliding_window_view(self._pending, WINDOW)[::HOP][:count]
        spectrum = np.fft.rfft(views * self._window, FFT)
        power = (spectrum.real**2 + spectrum.imag**2).astype(np.float32)
        features = self._normalise(np.matmul(power, self._mel, dtype=np.float32))
        self._pending = self._pending[count * HOP :]
        self._frames += count
        return features

    def _normalise(self, bands: NDArray[np.float32]) -> NDArray[np.float32]:
        out = np.empty_like(bands)
        for start in range(0, len(bands), BLOCK):
            block = bands[start : start + BLOCK].astype(np.float64)
            n = len(block)
            powers = self._powers[:n]
            mean = powers[:, None] * self._state.mean + self._lower[:n, :n] @ block
            weight = powers * self._state.weight + self._lower[:n, :n].sum(axis=1)
            level = np.log(block + FLOOR) - np.log(mean / weight[:, None] + FLOOR)
            out[start : start + n] = np.clip(level * SCALE, -LIMIT, LIMIT)
            self._state = _State(mean[-1], float(weight[-1]))
        return out


def encoder_features(samples: NDArray[np.float32]) -> NDArray[np.float32]:
    """(frame, 64) features of a whole sound at 16 kHz: `FrontEnd` fed once."""
    front_end = FrontEnd()
    return np.concatenate([front_end.push(samples), front_end.flush()])
