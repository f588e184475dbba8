"""A folder of words, each said by several voices: FOLDER/PART/WORD/VOICE.wav and .json.

The .json holds `phones`, [[start_s, end_s, phone], …], and in sentences `word`, [start_s, end_s].
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import soundfile

from recipes.corpus.subjects import SUBJECTS, Subject
from recipes.encoder.store import RATE
from recipes.encoder.synthesise import Espeak, Phones, utterance

MARGIN_S = 0.06  # of faint noise around what is said
VOICES = SUBJECTS[:6] + SUBJECTS[6:7] + SUBJECTS[8:11]
TUNING_VOICES = (
    Subject("us-adam", "male", 0, "espeak", "en-us+adam", 1.05, 45),
    Subject("gb-f2", "female", 0, "espeak", "en+f2", 0.9, 65),
    Subject("rp-iven", "male", 0, "espeak", "en-gb-x-rp+iven", 1.0, 35),
    Subject("us-linda", "female", 0, "espeak", "en-us+linda", 0.95, 55),
    Subject("clan-m3", "male", 0, "espeak", "en-gb-x-gbclan+m3", 1.15, 50),
    Subject("kal", "male", 0, "festival", "kal_diphone", 1.1),
)


@dataclass(frozen=True)
class Saying:
    samples: np.ndarray
    phones: Phones


class Speaker:
    """Says texts as any voice; how fast varies from take to take, by name and text alone."""

    def __init__(self) -> None:
        self.espeak = Espeak()

    def say(self, voice: Subject, text: str) -> Saying:
        draw = np.random.default_rng([ord(letter) for letter in voice.style + text])
        tempo = voice.tempo * draw.uniform(0.85, 1.2)
        samples, phones = utterance(
            self.espeak, voice.engine, voice.voice, text, tempo, voice.pitch
        )
        return trimmed(samples, [p for p in phones if p[2] != "SIL"], draw)


def trimmed(samples: np.ndarray, phones: Phones, draw: np.random.Generator | None) -> Saying:
    """What is said, with a margin: of faint noise, or where there is no `draw` of what is there."""
    start, end = phones[0][0], phones[-1][1]
    if draw is None:
        first = max(0, round((start - MARGIN_S) * RATE))
        moved = [(a - first / RATE, b - first / RATE, phone) for a, b, phone in phones]
        return Saying(samples[first : round((end + MARGIN_S) * RATE)], moved)
    body = samples[round(start * RATE) : round(end * RATE)]
    rests = [draw.normal(0, 2e-4, round(MARGIN_S * RATE)) for _ in range(2)]
    shift = MARGIN_S - start
    moved = [(a + shift, b + shift, phone) for a, b, phone in phones]
    return Saying(np.concatenate([rests[0], body, rests[1]]).astype(np.float32), moved)


def speak_all(
    folder: Path,
    part: str,
    words: Sequence[str],
    voices: Sequence[Subject],
    report: Callable[[float], None] | None = None,
) -> None:
    """Write what is not there yet; a take that a voice cannot say is left out."""
    speaker = Speaker()
    for done, word in enumerate(words):
        room = folder / part / word
        room.mkdir(parents=True, exist_ok=True)
        for voice in voices:
            path = room / f"{voice.style}.wav"
            if not path.with_suffix(".json").exists():
                save(path, speaker.say(voice, word))
        if report:
            report((done + 1) / len(words))


def speak_sentences(
    folder: Path,
    part: str,
    words: Sequence[str],
    voices: Sequence[Subject],
    frames: Sequence[str],
    report: Callable[[float], None] | None = None,
) -> None:
    """The same of sentences with the word in them: one frame for each voice, turn by turn."""
    speaker = Speaker()
    for done, word in enumerate(words):
        room = folder / part / word
        room.mkdir(parents=True, exist_ok=True)
        for place, voice in enumerate(voices):
            path = room / f"{voice.style}.wav"
            frame = frames[(place + done) % len(frames)]
            if not path.with_suffix(".json").exists():
                said = speaker.say(voice, frame.format(word))
                alone = speaker.say(voice, word)
                span = found_span(said.phones, [p[2] for p in alone.phones])
                if span:
                    save(path, said, span)
        if report:
            report((done + 1) / len(words))


def found_span(phones: Phones, word: list[str]) -> tuple[float, float] | None:
    """Where in a sentence the phones of a word stand; None where they are not there whole."""
    names = [p[2] for p in phones]
    for start in range(len(names) - len(word) + 1):
        if names[start : start + len(word)] == word:
            return phones[start][0], phones[start + len(word) - 1][1]
    return None


def save(path: Path, said: Saying, span: tuple[float, float] | None = None) -> None:
    """Sound and phones beside it."""
    soundfile.write(path, said.samples, RATE, subtype="PCM_16")
    record = {"phones": said.phones} | ({"word": span} if span else {})
    path.with_suffix(".json").write_text(json.dumps(record) + "\n", encoding="utf-8")
