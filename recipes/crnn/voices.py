"""Who speaks: many synthetic voices, whole families of them apart between the splits."""

# ruff: noqa: SIM905 - voices read better as text
from __future__ import annotations

import random
from dataclasses import dataclass

import numpy as np

from recipes.encoder.store import RATE
from recipes.encoder.synthesise import (
    ESPEAK_VARIANTS,
    FESTIVAL_VOICES,
    FLITE_VOICES,
    Espeak,
    Phones,
    utterance,
)

ACCENTS = "en-us en en-gb-scotland en-gb-x-rp en-029 en-gb-x-gbclan".split()
LEAD_S, TAIL_S = 0.3, 0.4  # of faint noise around the words, so that mouths rest too


@dataclass(frozen=True)
class Voice:
    """engine and name of a synthesiser's voice; pitch 0…99 and tempo are its own at 50 and 1."""

    engine: str
    name: str
    pitch: int = 50
    tempo: float = 1.0

    @property
    def speaker(self) -> str:
        return f"{self.engine}-{self.name}".replace("+", "-")


def voices(count: int, seed: int) -> dict[str, list[Voice]]:
    """Split to voices. Test voices are of engines and variants that nobody else has.

    A variant of espeak-ng (its formants) belongs to one split with all accents. The second
    engines are divided too: one voice of each is heard in the test alone.
    """
    draw = random.Random(seed)
    variants = sorted(ESPEAK_VARIANTS)
    draw.shuffle(variants)
    tenth = max(1, len(variants) // 10)
    parts = {
        "test": variants[:tenth],
        "validation": variants[tenth : 2 * tenth],
        "train": variants[2 * tenth :],
    }
    chosen: dict[str, list[Voice]] = {
        "train": [Voice("flite", "slt"), Voice("flite", "rms"), Voice("festival", "kal_diphone")],
        "validation": [Voice("flite", "awb")],
        "test": [Voice("flite", "kal16"), Voice("festival", "ked_diphone")],
    }
    assert {v.name for some in chosen.values() for v in some} <= {*FLITE_VOICES, *FESTIVAL_VOICES}
    shares = {"train": 0.8, "validation": 0.1, "test": 0.1}
    for part, names in parts.items():
        pool = [f"{accent}+{name}" for accent in ACCENTS for name in names]
        draw.shuffle(pool)
        for name in pool[: max(1, round(count * shares[part]) - len(chosen[part]))]:
            chosen[part].append(
                Voice("espeak", name, draw.randint(20, 80), draw.uniform(0.85, 1.25))
            )
    return chosen


class Speaker:
    """Says texts with any voice; espeak-ng is loaded once."""

    def __init__(self) -> None:
        self.espeak = Espeak()

    def say(self, voice: Voice, text: str, seed: int) -> tuple[np.ndarray, Phones]:
        """Samples at 16 kHz with rests around, and phones with their times."""
        draw = random.Random(seed)
        tempo = voice.tempo * draw.uniform(0.9, 1.1)
        pitch = voice.pitch
        if voice.engine == "espeak":
            pitch = min(99, max(1, pitch + draw.randint(-8, 8)))
        samples, phones = utterance(self.espeak, voice.engine, voice.name, text, tempo, pitch)
        noise = np.random.default_rng(seed)
        around = [noise.normal(0, 2e-4, round(s * RATE)) for s in (LEAD_S, TAIL_S)]
        whole = np.concatenate([around[0], samples, around[1]]).astype(np.float32)
        return whole, [(a + LEAD_S, b + LEAD_S, phone) for a, b, phone in phones]
