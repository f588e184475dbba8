"""Degraded speech: added noise, gain, and a telephone's band."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from elocute.array_types import Float32Array, Float64Array, FloatArray
from elocute.audio.waveform import Waveform
from elocute.errors import AudioError

SILENT = 1e-6  # a root mean square below this is silence
BABBLE_VOICES = 8
TELEPHONE_HZ = (300.0, 3400.0)
TELEPHONE_EDGES_HZ = (200.0, 3700.0)  # nothing passes beyond them
CAR_EVERY_S = 2.5  # on average
HORN_SHARE = 0.1  # of cars


def with_gain(sound: Waveform, gain_db: float) -> Waveform:
    """The same sound, louder or quieter."""
    factor = np.float32(10 ** (gain_db / 20))
    return Waveform(sound.samples * factor, sound.sample_rate)


def with_noise(speech: Waveform, noise: Float32Array, gain_db: float) -> Waveform:
    """Add noise to speech.

    Parameters
    ----------
    speech : Waveform
        What is said.
    noise : (sample,) float32
        At the speech's rate; repeated or cut to its length.
    gain_db : float
        Level of the noise relative to the speech (root mean squares), dB: -36 is a signal-to-noise
        ratio of 36 dB.

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


def street_noise(samples: int, sample_rate: int, seed: int) -> Float32Array:
    """Simulated traffic: cars that pass over a distant rumble. It is no recording of a street.

    One sample or more; the same seed gives the same street. Traffic is loudest below 200 Hz
    (engines) and about 1 kHz (tyres). Each car is tyre noise and a few harmonics of an engine,
    which swell and fade by more than 20 dB within seconds; now and then one sounds its horn.

    Returns
    -------
    (sample,) float32
    """
    rng, seconds = np.random.default_rng(seed), samples / sample_rate
    times = np.arange(samples) / sample_rate
    street = 0.5 * _coloured(rng, samples, sample_rate, _rumble)
    tyres = _coloured(rng, samples, sample_rate, _tyre_hiss)
    for _ in range(max(1, round(seconds / CAR_EVERY_S))):
        passing, half = rng.uniform(0, seconds), rng.uniform(0.4, 1.5)
        first, last = np.searchsorted(times, [passing - 4 * half, passing + 4 * half])
        now = times[first:last] - passing
        swell = rng.uniform(0.3, 1.5) / (1 + (now / half) ** 2)
        drop = 1 - 0.03 * np.tanh(now / half)  # its pitch falls as it passes
        phase = 2 * np.pi * rng.uniform(40, 90) * np.cumsum(drop) / sample_rate
        engine = sum(np.sin(n * phase + rng.uniform(0, 6)) / n for n in range(1, 7))
        street[first:last] += swell * (tyres[first:last] + 0.9 * engine)
        if rng.random() < HORN_SHARE:
            blown = (now > -0.4) & (now < rng.uniform(-0.2, 0.4))
            street[first:last] += blown * sum(np.sin(2 * np.pi * hz * now) for hz in (410, 510))
    return (0.1 * street).astype(np.float32)


def telephone_band(speech: Waveform) -> Waveform:
    """Speech as a telephone passes it, 300 to 3400 Hz, at the same rate."""
    count = len(speech.samples)
    hertz = np.fft.rfftfreq(count, 1 / speech.sample_rate)
    (low, high), (below, above) = TELEPHONE_HZ, TELEPHONE_EDGES_HZ
    passed = np.interp(hertz, [below, low, high, above], [0.0, 1.0, 1.0, 0.0])
    samples = np.fft.irfft(np.fft.rfft(speech.samples) * passed, count)
    return Waveform(samples.astype(np.float32), speech.sample_rate)


def _coloured(
    rng: np.random.Generator,
    samples: int,
    sample_rate: int,
    gain: Callable[[FloatArray], FloatArray],
) -> Float64Array:
    """(sample,) Gaussian noise of level 1 whose spectrum is `gain`, which takes Hz."""
    spectrum = np.fft.rfft(rng.normal(size=samples))
    noise = np.fft.irfft(spectrum * gain(np.fft.rfftfreq(samples, 1 / sample_rate)), samples)
    return noise / max(_level(noise), SILENT)


def _rumble(hertz: FloatArray) -> FloatArray:
    return (hertz > 20) / (1 + (hertz / 150) ** 1.5)


def _tyre_hiss(hertz: FloatArray) -> FloatArray:
    """About 1 kHz, two octaves wide."""
    return np.exp(-0.5 * np.log2(np.maximum(hertz, 1) / 1000) ** 2)


def _level(samples: FloatArray) -> float:
    return float(np.sqrt(np.square(samples.astype(np.float64)).mean()))
