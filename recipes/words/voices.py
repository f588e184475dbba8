"""Who says the words: captured speakers, and others, whose takes differ in tempo and pitch."""

# ruff: noqa: SIM905 - voices read better as text
from __future__ import annotations

import random
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from recipes.corpus.subjects import SUBJECTS, Subject
from recipes.encoder.store import RATE
from recipes.encoder.synthesise import Espeak, Phones, festival_utterance, flite_utterance

WORDS_PER_MINUTE = 150
LEAST, MOST = 0.12, 2.0  # s that a word may last
CAPTURED = tuple(s for s in SUBJECTS if s.style in ("plain", "calm", "crisp", "pouting"))
CAPTURED_TEST = "pouting"
SENTENCES = next(s for s in SUBJECTS if s.style == "drawl")  # nobody else has this voice
# Variants of espeak-ng that no other part has, one accent after another.
ACCENTS = ("en-us", "en", "en-gb-x-rp", "en-gb-scotland", "en-029", "en-gb-x-gbclan")
VARIANTS = (
    "Alex Andrea Gene Gene2 Henrique Hugo Jacky Lee Marco Mario anika benjamin boris caleb david "
    "edward f1 f2 grandma grandpa gustave iven2 iven3 iven4 m1 m2 m4 m5 m6 marcelo max michel "
    "miguel norbert pablo paul pedro quincy robert sandro steph3 travis zac edward2 linda"
).split()
MORE = tuple(
    ("espeak", f"{ACCENTS[place % len(ACCENTS)]}+{variant}")
    for place, variant in enumerate(VARIANTS)
)
# Voices that no captured speaker has; whole speakers in each part.
TRAIN = (
    ("flite", "awb"),
    ("flite", "kal16"),
    ("festival", "ked_diphone"),
    ("espeak", "en-us+Andy"),
    ("espeak", "en-us+adam"),
    ("espeak", "en-us+linda"),
    ("espeak", "en-us+f3"),
    ("espeak", "en+antonio"),
    ("espeak", "en+belinda"),
    ("espeak", "en+m3"),
    ("espeak", "en-gb-x-rp+iven"),
    ("espeak", "en-gb-x-rp+steph"),
    ("espeak", "en-gb-scotland+f4"),
    ("espeak", "en-029+john"),
    ("espeak", "en-gb-x-gbclan+m7"),
    *MORE,
)
VALIDATION = (
    ("espeak", "en-us+michael"),
    ("espeak", "en-gb-x-rp+f5"),
    ("espeak", "en+aunty"),
    ("espeak", "en-029+rob"),
    ("espeak", "en-gb-scotland+Denis"),
)
TEST = (
    ("espeak", "en-us+steph2"),
    ("espeak", "en+victor"),
    ("espeak", "en-gb-scotland+m8"),
    ("espeak", "en-gb-x-rp+Annie"),
    ("espeak", "en-029+ed"),
)
PARTS = {"train": TRAIN, "val": VALIDATION, "test": TEST}


def speaker_name(engine: str, voice: str) -> str:
    return f"{engine}-{voice.replace('+', '-')}"


class Voices:
    """Says a word as anybody; espeak-ng is loaded once."""

    def __init__(self) -> None:
        self.espeak = Espeak()

    def say(
        self, engine: str, voice: str, text: str, tempo: float, pitch: int
    ) -> tuple[np.ndarray, Phones]:
        """Samples at 16 kHz from the first phone to the last, and the phones."""
        if engine == "espeak":
            speed = round(WORDS_PER_MINUTE * tempo)
            return trimmed(*self.espeak.speak(text, voice, speed, pitch, 50))
        with tempfile.TemporaryDirectory() as room:
            if engine == "flite":
                hertz = 70 + 2.0 * pitch
                return trimmed(*flite_utterance(voice, text, 1 / tempo, Path(room), hertz))
            return trimmed(*festival_utterance(voice, text, 1 / tempo, Path(room)))

    def say_as(self, subject: Subject, text: str) -> tuple[np.ndarray, Phones]:
        return self.say(subject.engine, subject.voice, text, subject.tempo, subject.pitch)


def trimmed(samples: np.ndarray, phones: Phones) -> tuple[np.ndarray, Phones]:
    """Without the rests at both ends. Raises LookupError where no word is left."""
    spoken = [phone for phone in phones if phone[2] != "SIL"]
    if not spoken or not LEAST <= spoken[-1][1] - spoken[0][0] <= MOST:
        raise LookupError("nothing was said, or not one word")
    start, end = spoken[0][0], spoken[-1][1]
    shifted = [(a - start, b - start, phone) for a, b, phone in spoken]
    return samples[round(start * RATE) : round(end * RATE)].astype(np.float32), shifted


def with_floor(
    parts: Sequence[np.ndarray],
    spoken: Sequence[np.ndarray],
    noise_db: float,
    noise: np.random.Generator,
) -> np.ndarray:
    """Parts of a sound after one another over noise so far below those that are spoken."""
    clean = np.concatenate(parts)
    level = np.sqrt(np.mean(np.concatenate(spoken) ** 2)) * 10 ** (-noise_db / 20)
    return (clean + noise.normal(0, level, len(clean))).astype(np.float32)


def varied(speaker: str, word: str, take: int, seed: int) -> tuple[float, int, float, float]:
    """Tempo, pitch, playing rate and signal to noise in dB of a take: by its name alone."""
    draw = random.Random(f"{seed} {speaker} {word} {take}")
    return (
        draw.uniform(0.75, 1.3),
        draw.randint(25, 75),
        draw.uniform(0.92, 1.09),
        draw.uniform(15.0, 40.0),
    )
