"""Data augmentation of mel columns: another voice, room and microphone, noise, tempo.

Peaks are normalised before, so loudness alone changes nothing. Noise adds power to the bands, room
and microphone weigh them, another vocal tract shifts them, another tempo moves columns apart.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.audio.mel_with_deltas import BANDS, FLOOR

LOWEST = float(np.log(FLOOR))
TEMPO = (0.85, 1.2)
TRACT = (0.88, 1.14)
DB = float(np.log(10) / 10)  # of a natural logarithm of power


def random_tempo(rng: np.random.Generator) -> float:
    """How much faster a clip is played."""
    return float(np.exp(rng.uniform(*np.log(TEMPO))))


def interpolate_rows(values: NDArray[np.floating], places: NDArray[np.floating]) -> Float32Array:
    """(place, feature) linear between rows of (row, feature), held at both ends."""
    places = np.clip(places, 0, len(values) - 1)
    below = np.minimum(places.astype(np.intp), max(len(values) - 2, 0))
    above = np.minimum(below + 1, len(values) - 1)
    share = (places - below).astype(np.float32)[:, None]
    return np.asarray(values[below] * (1 - share) + values[above] * share, np.float32)


def degrade(static: Float32Array, other: Float32Array, rng: np.random.Generator) -> Float32Array:
    """(column, 128) log-mel bands degraded at random; `other` is other speech, for babble."""
    bands = np.arange(BANDS)
    static = interpolate_rows(static.T, bands * np.exp(rng.uniform(*np.log(TRACT)))).T
    static = static + _curve(rng, 6.0)
    if rng.random() < 0.3:
        static = _limited(static, rng)
    power = np.exp(static)
    if rng.random() < 0.7:
        power = power + _noise(power, other, rng)
    # As if the peak that was normalised were elsewhere: a cough, a louder word.
    level = rng.uniform(-10, 3) * DB
    return np.maximum(np.log(power + 1e-12) + level, LOWEST).astype(np.float32)


def _curve(rng: np.random.Generator, most_db: float) -> Float32Array:
    """(128,) a microphone's and a room's colour: slow waves over the bands."""
    x = np.linspace(0, 1, BANDS)
    waves = [np.cos(np.pi * (k * x + rng.random() * 2)) / k for k in (1, 2, 3, 5)]
    sizes = rng.uniform(-most_db, most_db, len(waves)) * DB
    return np.asarray(sizes @ np.array(waves), np.float32)


def _limited(static: Float32Array, rng: np.random.Generator) -> Float32Array:
    """As over a telephone: little below or above a band."""
    bands = np.arange(BANDS)
    top, low = rng.uniform(55, 100), rng.uniform(0, 12)
    slope = rng.uniform(0.5, 4) * DB
    loss = slope * (np.maximum(bands - top, 0) + np.maximum(low - bands, 0))
    return static - loss.astype(np.float32)


def _noise(power: Float32Array, other: Float32Array, rng: np.random.Generator) -> Float32Array:
    """(column, 128) power of noise, 0 to 35 dB below the speech."""
    count = len(power)
    if rng.random() < 0.3:
        again = np.resize(np.roll(np.exp(other[::-1]), rng.integers(len(other)), 0), (count, BANDS))
        noise = again + np.roll(again, count // 3, 0)
    else:
        colour = np.exp(_curve(rng, 12.0) - rng.uniform(0, 0.06) * np.arange(BANDS))
        flicker = rng.gamma(3.0, 1 / 3, (count, BANDS)).astype(np.float32)
        swell = 1 + 0.8 * np.sin(np.arange(count) * rng.uniform(0.01, 0.3))[:, None]
        noise = colour * flicker * (swell if rng.random() < 0.3 else 1)
    ratio = power.mean() / max(float(noise.mean()), 1e-20)
    return (noise * ratio * 10 ** (-rng.uniform(0, 35) / 10)).astype(np.float32)
