"""Captured readings: a speaker reads ten words after another, with exact times and motion."""

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
from recipes.words.voices import Voices

IN_A_READING = 10
LEAD_S, BETWEEN_S = 0.3, 0.3
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
    pause_s: float = 0.0,
) -> Iterator[Clip]:
    """Clips of one subject; the times of their words go to FOLDER/SUBJECT.SENTENCE.json.

    simulate takes phones, sound, style, a name of the take, and frames a second.
    """
    for number, start in enumerate(range(0, len(texts), IN_A_READING)):
        spoken = texts[start : start + IN_A_READING]
        samples, phones, words = _read(voices, subject, spoken, (seed, number), pause_s)
        duration = len(samples) / RATE
        name = f"r{number:03}"
        write_words(TimedWords(tuple(words), duration), folder / f"{subject.style}.{name}.json")
        sound = Waveform(samples, RATE)
        frames = simulate(phones, sound, subject.style, f"{seed}.{name}", fps)
        yield Clip(subject.style, name, " ".join(spoken), sound, frames)


def _read(
    voices: Voices,
    subject: Subject,
    texts: Sequence[str],
    seed: tuple[int, int],
    pause_s: float,
) -> tuple[np.ndarray, Phones, list[TimedWord]]:
    noise = np.random.default_rng(seed)

    def rest(seconds: float) -> np.ndarray:
        return noise.normal(0, 2e-4, round(seconds * RATE)).astype(np.float32)

    parts, phones, words = [rest(LEAD_S)], [], []
    at = len(parts[0])
    for number, text in enumerate(texts, 1):
        samples, said = voices.say_as(subject, text)
        start = at / RATE
        phones += [(a + start, b + start, phone) for a, b, phone in said]
        words.append(TimedWord(text, start, start + len(samples) / RATE))
        parts += [samples, rest(BETWEEN_S + pause_s * (number == PAUSE_AFTER))]
        at += len(samples) + len(parts[-1])
    return np.concatenate(parts), phones, words
