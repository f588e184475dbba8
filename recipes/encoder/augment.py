"""Augmentation: what stands between a clean studio voice and somebody's recording.

Waveform effects are cheap NumPy; equalisation, vocal tract length, band limits and masking act
on the power spectrum inside the batch (`spectrum.py`).
"""

from __future__ import annotations

import random
from typing import cast

import numpy as np
from scipy import fft

from recipes.encoder.store import HOP, RATE

CHUNK_FRAMES = 800  # 8 s of labels at 100 Hz


class Augmenter:
    """Draws effects from one seeded generator; noises are float arrays at 16 kHz."""

    def __init__(self, noises: list[np.ndarray], seed: int) -> None:
        self.draw = random.Random(seed)
        self.numbers = np.random.default_rng(seed)
        self.noises = noises
        # A minute of white noise to cut from: drawing it anew took longer than all the rest.
        self.bank = self.numbers.standard_normal(60 * RATE, np.float32)

    def white(self, count: int) -> np.ndarray:
        """(count,) float32, a random stretch of the bank."""
        begin = self.draw.randrange(len(self.bank) - count)
        return self.bank[begin : begin + count]

    def chance(self, share: float) -> bool:
        return self.draw.random() < share

    def __call__(self, samples: np.ndarray, babble: np.ndarray) -> np.ndarray:
        """(sample,) float32 in, the same length out."""
        level = np.sqrt(np.mean(samples**2)) + 1e-7
        if self.chance(0.35):
            samples = self._reverberate(samples)
        if self.chance(0.6):
            samples = samples + self._noise(len(samples), level, babble)
        if self.chance(0.12):
            samples = self._compand(samples)
        gain_db = self.draw.uniform(-12, 8) if self.chance(0.6) else self.draw.uniform(-45, 0)
        samples = samples * (10 ** (gain_db / 20) * 0.08 / level)
        if self.chance(0.1):
            limit = np.abs(samples).max() * self.draw.uniform(0.1, 0.6)
            samples = np.clip(samples, -limit, limit)
        if self.chance(0.5):
            samples = np.round(np.clip(samples, -1, 1) * 32767) / 32768
        return samples.astype(np.float32)

    def _reverberate(self, samples: np.ndarray) -> np.ndarray:
        length = int(self.draw.uniform(0.05, 0.6) * RATE)
        decay = np.exp(-6.9 * np.arange(length) / length)
        response = self.white(length) * decay.astype(np.float32) * self.draw.uniform(0.01, 0.1)
        response[0] = 1.0
        # scipy documents this function by a Python body that returns nothing.
        size = cast(int, fft.next_fast_len(len(samples) + length, real=True))
        wet = _sound(_spectrum(samples, size) * _spectrum(response, size), size)
        return wet[: len(samples)]

    def _noise(self, count: int, level: float, babble: np.ndarray) -> np.ndarray:
        kind = self.draw.random()
        if kind < 0.3 and self.noises:
            source = self.draw.choice(self.noises)
            noise = np.resize(np.roll(source, self.draw.randrange(len(source))), count)
        elif kind < 0.5:
            noise = babble
        else:
            noise = self._coloured(count)
        snr_db = self.draw.uniform(0, 35)
        return noise * (level / (np.sqrt(np.mean(noise**2)) + 1e-9) * 10 ** (-snr_db / 20))

    def _coloured(self, count: int) -> np.ndarray:
        """White to brown noise, sometimes swelling, sometimes with a hum."""
        spectrum = _spectrum(self.white(count), count)
        slope = -self.draw.uniform(0, 1.2)
        spectrum *= (np.arange(len(spectrum), dtype=np.float32) + 50.0) ** slope
        noise = _sound(spectrum, count)
        if self.chance(0.3):
            noise *= 1 + 0.9 * np.sin(np.arange(count) * (self.draw.uniform(0.3, 6) * 6.28 / RATE))
        if self.chance(0.15):
            tone = self.draw.uniform(50, 400) * 6.28 / RATE
            noise = noise / (noise.std() + 1e-9) + np.sin(np.arange(count) * tone)
        return noise

    def _compand(self, samples: np.ndarray) -> np.ndarray:
        """8-bit mu-law, as on a telephone line."""
        peak = np.abs(samples).max() + 1e-6
        squeezed = np.sign(samples) * np.log1p(255 * np.abs(samples) / peak) / np.log(256)
        steps = np.round(squeezed * 127) / 127
        return np.sign(steps) * (256 ** np.abs(steps) - 1) / 255 * peak


def stretch(samples: np.ndarray, labels: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Play faster (rate above 1) or slower, pitch with it; CHUNK_FRAMES come out."""
    count = CHUNK_FRAMES * HOP
    times = np.arange(count) * rate
    samples = np.interp(times, np.arange(len(samples)), samples).astype(np.float32)
    picks = (np.arange(CHUNK_FRAMES) * rate).astype(int)
    return samples, labels[np.minimum(picks, len(labels) - 1)]


def silence_gap(draw: random.Random) -> tuple[np.ndarray, np.ndarray]:
    """A rest between two utterances, labelled silence."""
    frames = int(draw.uniform(0.1, 1.5) * 100)
    return np.zeros(frames * HOP, np.float32), np.zeros(frames, np.uint8)


def _spectrum(samples: np.ndarray, size: int) -> np.ndarray:
    """scipy's own annotations give what its dispatcher takes, not what the transform returns."""
    return np.asarray(fft.rfft(samples, size))


def _sound(spectrum: np.ndarray, size: int) -> np.ndarray:
    return np.asarray(fft.irfft(spectrum, size))
