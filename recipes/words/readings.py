"""Captured readings: a speaker reads ten words after another, with exact times and motion.

Each reading has a floor of noise as a recording has one, so that no network tells captured words
from others by their rests.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from elocute.audio.waveform import Waveform
from elocute.corpus.clip import Clip
from elocute.speech.text.word_times import TimedWord, TimedWords, write_words
from recipes.corpus.subjects import Subject
from recipes.encoder.store import RATE
from recipes.encoder.synthesise import Phones
from recipes.words.voices import Voices, varied, with_floor

IN_A_READING = 10
REST_S = 0.3  # before, between and after words, as around those of `takes`
PAUSE_AFTER = 5  # words, where a reading has a longer pause
Simulate = Callable[[Phones, Waveform, str, str, float], np.ndarray]


def readings(
    voices: Voices,
    subject: Subject,
    texts: Sequence[str],
    simulate: Simulate,
    fps: float,
    folder: Path,
    seed: int,
    spoken: dict[str, Phones],
    pause_s: float = 0.0,
) -> Iterator[Clip]:
    """Clips of one subject; the times of their words go to FOLDER/SUBJECT.SENTENCE.json.

    `spoken` receives the phones of each clip and their times, by "captured/SUBJECT.SENTENCE".
    simulate takes phones, sound, style, a name of the take, and frames a second.
    """
    for number, start in enumerate(range(0, len(texts), IN_A_READING)):
        some = texts[start : start + IN_A_READING]
        samples, phones, words = _read(voices, subject, some, (seed, number), pause_s)
        duration = len(samples) / RATE
        name = f"r{number:03}"
        write_words(TimedWords(tuple(words), duration), folder / f"{subject.style}.{name}.json")
        spoken[f"captured/{subject.style}.{name}"] = phones
        sound = Waveform(samples, RATE)
        frames = simulate(phones, sound, subject.style, f"{seed}.{name}", fps)
        yield Clip(subject.style, name, " ".join(some), sound, frames)


def _read(
    voices: Voices,
    subject: Subject,
    texts: Sequence[str],
    seed: tuple[int, int],
    pause_s: float,
) -> tuple[np.ndarray, Phones, list[TimedWord]]:
    def rest(seconds: float) -> np.ndarray:
        return np.zeros(round(seconds * RATE), np.float32)

    parts, phones, words = [rest(REST_S)], [], []
    at = len(parts[0])
    for number, text in enumerate(texts, 1):
        samples, said = voices.say_as(subject, text)
        start = at / RATE
        phones += [(a + start, b + start, phone) for a, b, phone in said]
        words.append(TimedWord(text, start, start + len(samples) / RATE))
        parts += [samples, rest(REST_S + pause_s * (number == PAUSE_AFTER))]
        at += len(samples) + len(parts[-1])
    *_, noise_db = varied(subject.style, str(seed[1]), 0, seed[0])
    noise = np.random.default_rng(seed)
    return with_floor(parts, parts[1::2], noise_db, noise), phones, words
