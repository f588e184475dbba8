"""Voices and noises made by formula, varied by chance: what recordings have too little of."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from scipy.signal import lfilter

from elocute.array_types import Float64Array

RATE = 16_000
FORMANTS_HZ = {
    "a": (730, 1090, 2440),
    "e": (530, 1840, 2480),
    "i": (270, 2290, 3010),
    "o": (570, 840, 2410),
    "u": (300, 870, 2240),
    "ae": (660, 1720, 2410),
}
BANDWIDTHS_HZ = (80, 100, 140)
HIGHEST_HZ = 7500.0
PEAK = 0.25
Draw = np.random.Generator


def harmonics(pitch_hz: Float64Array, count: int, decay: float, draw: Draw) -> Float64Array:
    """Harmonics of a pitch that moves, each `decay` powers weaker than the one before."""
    phase = 2 * np.pi * np.cumsum(pitch_hz) / RATE
    return np.sum(
        [
            np.sin(n * phase + draw.uniform(0, 6)) / n**decay * (n * pitch_hz < HIGHEST_HZ)
            for n in range(1, count + 1)
        ],
        axis=0,
    )


def vowels(pitch_hz: Float64Array, said: list[str], breath: float, draw: Draw) -> Float64Array:
    """Vowels one after the other at a pitch: a pulse through formants."""
    source = harmonics(pitch_hz, 40, 0.0 + 1.0, draw) + breath * draw.normal(size=len(pitch_hz))
    sound, each, scale = (
        np.zeros(len(source)),
        len(source) // len(said) + 1,
        draw.uniform(0.95, 1.2),
    )
    for place, vowel in enumerate(said):
        part = slice(max(0, place * each - 200), min(len(source), (place + 1) * each + 200))
        heard = source[part]
        for centre_hz, band_hz in zip(FORMANTS_HZ[vowel], BANDWIDTHS_HZ, strict=True):
            radius, turn = (
                np.exp(-np.pi * band_hz / RATE),
                np.cos(2 * np.pi * centre_hz * scale / RATE),
            )
            poles = [1, -2 * radius * turn, radius**2]
            heard = np.asarray(lfilter([sum(poles)], poles, heard))
        edge = np.minimum(np.arange(len(heard)), np.arange(len(heard))[::-1]) / 200
        sound[part] += heard * np.clip(edge, 0, 1)
    return sound


def song(draw: Draw) -> Float64Array:
    """Vowels on a melody, with vibrato."""
    count, notes = round(draw.uniform(1.5, 5) * RATE), int(draw.integers(2, 8))
    t = np.arange(count) / RATE
    steps = np.repeat(draw.choice([0, 2, 4, 5, 7, 9, 12, -3], notes), count // notes + 1)[:count]
    steps = np.convolve(steps, np.ones(800) / 800, "same")
    vibrato = 0.012 * np.sin(2 * np.pi * draw.uniform(4.5, 6.5) * t) * np.clip(t, 0, 1)
    pitch = draw.uniform(110, 500) * 2 ** (steps / 12) * (1 + vibrato)
    said = list(draw.choice(list(FORMANTS_HZ), int(draw.integers(1, 8))))
    return np.pad(vowels(pitch, said, 0.04, draw), 4000)


def laughter(draw: Draw) -> Float64Array:
    """Short vowels between breaths, slowly falling."""
    pitch_hz, vowel = draw.uniform(140, 480), str(draw.choice(["a", "e", "ae", "i"]))
    parts = [np.zeros(4000)]
    for _ in range(draw.integers(4, 12)):
        count, breath = (
            round(draw.uniform(0.06, 0.12) * RATE),
            round(draw.uniform(0.05, 0.12) * RATE),
        )
        pitch = pitch_hz * np.linspace(1.1, 0.9, count) * draw.uniform(0.9, 1.1)
        ha = vowels(pitch, [vowel], 0.2, draw) * np.hanning(count)
        parts += [0.1 * draw.normal(size=breath) * np.hanning(breath), ha / np.abs(ha).max()]
        pitch_hz *= 0.97
    return np.concatenate([*parts, np.zeros(4000)])


def barks(draw: Draw) -> Float64Array:
    """Bursts of harmonics and noise."""
    sound, at_s = np.zeros(round(draw.uniform(2, 5) * RATE)), draw.uniform(0.2, 0.5)
    while at_s < len(sound) / RATE - 0.4:
        share = np.linspace(0, 1, round(draw.uniform(0.08, 0.3) * RATE))
        pitch = draw.uniform(250, 900) * (1 + draw.uniform(-0.6, 0.3) * share)
        burst = harmonics(pitch, int(draw.integers(4, 16)), draw.uniform(0.5, 1.5), draw)
        burst += draw.uniform(0.1, 1) * draw.normal(size=len(share))
        first = round(at_s * RATE)
        sound[first : first + len(share)] += burst * np.sin(np.pi * share) ** draw.uniform(0.3, 1)
        at_s += len(share) / RATE + draw.uniform(0.15, 0.9)
    return sound


def music(draw: Draw) -> Float64Array:
    """Chords or a melody, plucked or held, now and then with drums."""
    sound, at = np.zeros(round(draw.uniform(2, 6) * RATE)), 0
    root_hz, decay = draw.uniform(110, 330), draw.uniform(0.7, 2)
    held, together = draw.uniform() < 0.3, draw.choice([1, 3])
    while at < len(sound) - RATE // 10:
        count = min(len(sound) - at, len(sound) if held else round(draw.uniform(0.12, 1.2) * RATE))
        fading = 1.0 if held else np.exp(-np.arange(count) / RATE * draw.uniform(0.5, 6))
        for step in draw.choice([0, 3, 4, 5, 7, 9, 12], together, replace=False):
            tone = np.full(count, root_hz * 2 ** (step / 12))
            sound[at : at + count] += fading * harmonics(
                tone, int(draw.integers(3, 12)), decay, draw
            )
        at += count
    if draw.uniform() < 0.25:
        drum = 3 * draw.normal(size=1600) * np.exp(-np.arange(1600) / 300)
        for first in range(0, len(sound) - 1600, round(0.4 * RATE)):
            sound[first : first + 1600] += drum
    return sound


def tones(draw: Draw) -> Float64Array:
    """Whistles, beeps and alarms: one or a few pure tones, held, gliding or in bursts."""
    count = round(draw.uniform(1, 6) * RATE)
    t, sound = np.arange(count) / RATE, np.zeros(count)
    for _ in range(draw.integers(1, 4)):
        base_hz, glide = draw.uniform(120, 3000), draw.choice([0.0, draw.uniform(-0.5, 0.5)])
        sound += draw.uniform(0.3, 1) * np.sin(
            2 * np.pi * np.cumsum(base_hz * (1 + glide * t / t[-1])) / RATE
        )
    if draw.uniform() < 0.4:
        sound *= t % draw.uniform(0.2, 1.5) < draw.uniform(0.1, 0.8)
    return np.pad(sound, round(draw.uniform(0, 0.5) * RATE))


def machines(draw: Draw) -> Iterator[Float64Array]:
    """A horn, a siren, a rumble, claps and an engine."""
    count = round(draw.uniform(2, 5) * RATE)
    t, base_hz = np.arange(count) / RATE, draw.uniform(250, 900)
    white = draw.normal(size=count)
    tones = [harmonics(np.full(count, base_hz * r), 12, 0.6, draw) for r in (1, 1.26)]
    yield sum(tones) * (t % draw.uniform(0.6, 2) < draw.uniform(0.3, 0.6)) + 0.001 * white
    swing = draw.uniform(50, 300) * np.sin(2 * np.pi * draw.uniform(0.2, 3) * t)
    yield harmonics(base_hz + swing, int(draw.integers(2, 9)), 1.0, draw)
    yield np.asarray(lfilter([1], [1, -0.98], white)) * np.exp(-(t % draw.uniform(1, 3)))
    claps = np.zeros(count)
    for first in draw.integers(0, count - 600, int(draw.uniform(10, 200) * count / RATE)):
        claps[first : first + 600] += draw.normal(size=600) * np.exp(
            -np.arange(600) / draw.uniform(20, 200)
        )
    yield claps
    idle = draw.uniform(30, 120) * (1 + 0.05 * np.cumsum(white) / np.sqrt(count))
    throat = [1, -draw.uniform(0.5, 0.95)]
    yield np.asarray(lfilter([1], throat, harmonics(idle, 20, 0.3, draw))) + 0.3 * white


def made_sounds(seed: int, each: int) -> Iterator[tuple[bool, Float64Array]]:
    """Whether it is a voice, and samples at 16 kHz, so many of each sort."""
    draw = np.random.default_rng(seed)
    sorts: list[tuple[bool, Callable[[Draw], Float64Array]]] = [
        (True, song), (True, laughter), (False, barks), (False, music), (False, tones),
    ]  # fmt: skip
    for _ in range(each):
        for voice, make in sorts:
            yield voice, levelled(make(draw))
        for sound in machines(draw):
            yield False, levelled(sound)


def levelled(sound: Float64Array) -> Float64Array:
    """The same at one peak."""
    return PEAK * sound / (np.abs(sound).max() + 1e-9)
