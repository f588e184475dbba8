"""Degraded speech: added noise, and gain."""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.waveform import Waveform
from elocute.errors import AudioError

SILENT = 1e-6  # a root mean square below this is silence
BABBLE_VOICES = 8


def with_gain(sound: Waveform, gain_db: float) -> Waveform:
    """The same sound, louder or quieter."""
    factor = np.float32(10 ** (gain_db / 20))
    return Waveform(sound.samples * factor, sound.sample_rate)


def with_noise(speech: Waveform, noise: Float32Array, gain_db: float) -> Waveform:
    """Add noise to speech.

    Parameters
    ----------
    speech : Waveform
        The speech.
    noise : (sample,) float32
        At the speech's rate; repeated or cut to its length.
    gain_db : float
        Level of the noise relative to the speech (root mean squares), dB: -36 is a signal-to-noise
        ratio of 36 dB.

    Returns
    -------
    Waveform

    Raises
    ------
    AudioError
        For silent noise.
    """
    fitted = np.resize(noise, len(speech.samples))
    level = _level(fitted)
    if level < SILENT:
        raise AudioError.about("noise", found="silence", allowed="a sound")
    factor = _level(speech.samples) / level * 10 ** (gain_db / 20)
    mixed = speech.samples + np.float32(factor) * fitted
    return Waveform(mixed.astype(np.float32), speech.sample_rate)


def white_noise(samples: int, seed: int) -> Float32Array:
    """(sample,) with a flat spectrum."""
    return np.random.default_rng(seed).normal(0, 0.1, samples).astype(np.float32)


def babble(speech: Waveform, seed: int) -> Float32Array:
    """(sample,) many voices at once: the speech itself backwards, eight times, shifted in time.

    It has a voice's spectrum and rhythm and no word of the original.
    """
    backwards, rng = speech.samples[::-1], np.random.default_rng(seed)
    shifts = rng.integers(0, len(backwards), BABBLE_VOICES)
    return np.mean([np.roll(backwards, shift) for shift in shifts], axis=0).astype(np.float32)


def _level(samples: Float32Array) -> float:
    return float(np.sqrt(np.square(samples.astype(np.float64)).mean()))
