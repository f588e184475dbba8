"""The same speech as others would hear it: another microphone, room, noise, and a quicker voice."""

from __future__ import annotations

import zlib
from collections.abc import Sequence

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.waveform import SPEECH_RATE
from recipes.encoder.augment import Augmenter

RATES = (0.88, 1.14)  # between which speech is played slower or faster, pitch with it
TILT_DB = 8.0  # of the spectrum, over the bands
BANDS = 8


class Disguise:
    """One disguise of each recording, drawn from its name and a seed.

    Parameters
    ----------
    noises : sequence of (sample,) float32
        Without a voice, 16 kHz.
    seed : int
        Another seed, another disguise.
    """

    def __init__(self, noises: Sequence[Float32Array], seed: int) -> None:
        self._noises, self._seed = list(noises), seed

    def rate(self, name: str) -> float:
        """How much faster a recording is played."""
        return float(self._draw(name).uniform(*RATES))

    def __call__(self, samples: Float32Array, name: str) -> Float32Array:
        """(sample,) float32 in; out as many as its rate leaves."""
        draw = self._draw(name)
        rate = float(draw.uniform(*RATES))
        moments = np.arange(int(len(samples) / rate)) * rate
        played = np.interp(moments, np.arange(len(samples)), samples).astype(np.float32)
        played = self._equalised(played, draw)
        augment = Augmenter(self._noises, int(draw.integers(2**31)))
        babble = np.roll(played[::-1], int(draw.integers(len(played))))
        return augment(played, babble)

    def _draw(self, name: str) -> np.random.Generator:
        return np.random.default_rng([self._seed, zlib.crc32(name.encode())])

    @staticmethod
    def _equalised(samples: Float32Array, draw: np.random.Generator) -> Float32Array:
        """Bands up and down by a few decibels, evenly spaced in octaves."""
        spectrum = np.fft.rfft(samples)
        hertz = np.fft.rfftfreq(len(samples), 1 / SPEECH_RATE)
        edges = np.geomspace(80, SPEECH_RATE / 2, BANDS)
        gains_db = draw.uniform(-TILT_DB, TILT_DB, BANDS)
        shape = np.interp(np.log(np.maximum(hertz, 1)), np.log(edges), gains_db)
        return np.fft.irfft(spectrum * 10 ** (shape / 20), len(samples)).astype(np.float32)
