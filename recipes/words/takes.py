"""Recordings of single words as WORD/{train,val,test}/SPEAKER__TAKE.wav.

Rests are left around a word, and SPEAKER__TAKE.txt says how long the word in the middle is, as in
LRW: words of recordings are cut as those of the captured readings are.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import soundfile

from recipes.encoder.augment import stretch
from recipes.encoder.natural import EnglishAligner, list_recordings, read, split_of
from recipes.encoder.store import RATE
from recipes.encoder.synthesise import Phones
from recipes.words.readings import REST_S
from recipes.words.voices import PARTS, Voices, speaker_name, varied, with_floor

SHORTEST_S, LONGEST_S = 0.15, 1.5  # of a natural word worth keeping
NATURAL_PARTS = {"train": "train", "test": "test"}


def speak_takes(
    voices: Voices,
    folder: Path,
    words: Sequence[str],
    takes: dict[str, int],
    seed: int,
    *,
    held: Sequence[str] = (),
    spoken: dict[str, Phones] | None = None,
) -> Iterator[Path]:
    """Every word by so many speakers of each part, drawn by the word's name.

    Words of `held` are said by all speakers of validation and test. `spoken` receives the phones of
    each file and their times in it, by its name beside `folder`.
    """
    for word in words:
        for part, count in takes.items():
            if word in held and part != "train":
                count = len(PARTS[part])
            speakers = sorted(PARTS[part])
            chosen = random.Random(f"{seed} {word} {part}").sample(
                speakers, min(count, len(speakers))
            )
            for engine, voice in chosen:
                take = _take(voices, engine, voice, word, seed)
                if take is not None:
                    path = folder / word / part / f"{speaker_name(engine, voice)}__0.wav"
                    if spoken is not None:
                        spoken[path.relative_to(folder.parent).as_posix()] = take[1]
                    yield _written(path, *take)


def _take(
    voices: Voices, engine: str, voice: str, word: str, seed: int
) -> tuple[np.ndarray, Phones] | None:
    """(sample,) with tempo, pitch and noise of its own, and phones with their times.

    None where the voice fails at the word.
    """
    tempo, pitch, rate, noise_db = varied(speaker_name(engine, voice), word, 0, seed)
    try:
        samples, phones = voices.say(engine, voice, word, tempo, pitch)
    except LookupError:
        return None
    count = int(len(samples) / rate)
    played, _ = stretch(samples, np.zeros(1, np.uint8), rate)
    rest = np.zeros(round(REST_S * RATE), np.float32)
    draw = np.random.default_rng([ord(c) for c in f"{seed} {engine} {voice} {word}"])
    times = [(a / rate + REST_S, b / rate + REST_S, phone) for a, b, phone in phones]
    return with_floor([rest, played[:count], rest], [samples], noise_db, draw), times


def cut_natural(data: Path, folder: Path, words: Sequence[str], limit: int) -> Iterator[Path]:
    """Words cut from natural English by forced alignment; speakers as the encoder's split."""
    aligner, wanted, taken = EnglishAligner(), set(words), 0
    english = [
        one
        for one in list_recordings(data)
        if one.language == "en" and wanted & set(one.text.lower().split())
    ]
    random.Random("natural").shuffle(english)
    for recording in english:
        if taken >= limit:
            return
        samples = read(recording.path)
        spoken = aligner.spoken(samples, recording.text) or []
        speaker = f"{recording.source}-{recording.speaker or recording.path.stem}"
        for place, word in enumerate(spoken):
            if word.text not in wanted or not SHORTEST_S <= word.end_s - word.start_s <= LONGEST_S:
                continue
            name = f"{_short(speaker)}__{_short(recording.path.stem)}-{place}.wav"
            part = NATURAL_PARTS[split_of(recording)]
            # As much on both sides, so that the word is in the middle.
            rest = min(REST_S, word.start_s, len(samples) / RATE - word.end_s)
            first, last = word.start_s - rest, word.end_s + rest
            cut = samples[round(first * RATE) : round(last * RATE)]
            taken += 1
            yield _written(folder / word.text / part / name, cut, [(rest, last - first - rest, "")])


def _short(text: str) -> str:
    """The end of a name, which tells it from others, in characters that a clip's name may have."""
    plain = "".join(c if c.isascii() and c.isalnum() else "-" for c in text)
    return plain[-40:].strip("-") or "x"


def _written(path: Path, samples: np.ndarray, spoken: Phones) -> Path:
    """The sound, and how long the word in its middle is."""
    path.parent.mkdir(parents=True, exist_ok=True)
    soundfile.write(path, np.clip(samples, -1, 1), RATE, subtype="PCM_16")
    seconds = spoken[-1][1] - spoken[0][0]
    path.with_suffix(".txt").write_text(f"Duration: {seconds:.4f} seconds\n", encoding="utf-8")
    return path
