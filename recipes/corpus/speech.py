"""One sentence said by a synthetic voice, with the times of its phones."""

from __future__ import annotations

import numpy as np

from recipes.corpus.subjects import Subject
from recipes.encoder.store import RATE
from recipes.encoder.synthesise import Espeak, Phones, utterance

LEAD_S, TAIL_S = 0.25, 0.35  # of faint noise around the words, so that mouths rest too
SHORTEST_S, LONGEST_S = 3.0, 5.0


class Speaker:
    """Says sentences as any of the subjects; espeak-ng is loaded once."""

    def __init__(self) -> None:
        self.espeak = Espeak()

    def say(self, subject: Subject, text: str, seed: int) -> tuple[np.ndarray, Phones]:
        """Samples at 16 kHz and phones, 3 to 5 s long: what is not gets said again faster."""
        tempo = subject.tempo
        samples, phones = self._at(tempo, subject, text)
        for _ in range(3):
            length = len(samples) / RATE + LEAD_S + TAIL_S
            if SHORTEST_S <= length <= LONGEST_S:
                break
            wanted = min(max(length, SHORTEST_S * 1.03), LONGEST_S * 0.97)
            tempo *= length / wanted
            samples, phones = self._at(tempo, subject, text)
        return _padded(samples, phones, seed)

    def _at(self, tempo: float, subject: Subject, text: str) -> tuple[np.ndarray, Phones]:
        return utterance(self.espeak, subject.engine, subject.voice, text, tempo, subject.pitch)


def _padded(samples: np.ndarray, phones: Phones, seed: int) -> tuple[np.ndarray, Phones]:
    noise = np.random.default_rng(seed)
    lead = noise.normal(0, 2e-4, round(LEAD_S * RATE))
    tail = noise.normal(0, 2e-4, round(TAIL_S * RATE))
    shifted = [(a + LEAD_S, b + LEAD_S, phone) for a, b, phone in phones]
    return np.concatenate([lead, samples, tail]).astype(np.float32), shifted


def voices_missing() -> list[str]:
    """Programs that the recipe needs and this machine lacks."""
    import shutil

    missing = [name for name in ("flite", "festival") if not shutil.which(name)]
    try:
        Espeak()
    except OSError:
        missing.append("espeak-ng")
    return missing
