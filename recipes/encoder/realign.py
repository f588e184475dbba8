"""Viterbi alignment by the encoder that ships, where pocketsphinx has no dictionary.

German, Dutch and Spanish, and English words such as wake words, against espeak-ng's phones.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from elocute.encoders.phone_encoder import builtin_encoder
from elocute.encoders.phones_and_visemes import PHONES, SILENCE
from recipes.encoder.natural import (
    EnglishAligner,
    Recording,
    list_precise,
    list_recordings,
    read,
    split_of,
)
from recipes.encoder.store import HOP, ShardWriter
from recipes.encoder.synthesise import Espeak

VOICES = {"en": "en-us"}  # espeak-ng's voice where it is not named as the language
# Speakers of German make their r at the back of the mouth, unlike espeak-ng: the lips stay put.
UVULAR = {"R": "HH"}
FRAME_LEAST = -8.0  # no single frame may veto a path
REST_COST = 3.0  # of a rest between two phones: a stop's closure belongs to the stop
WORST = -2.7  # mean log-posterior of the spoken phones below which text and sound do not fit


def viterbi(log_posteriors: np.ndarray, phones: list[int]) -> tuple[np.ndarray, float]:
    """(frame,) phones of the best path through `phones` in order, and the mean score of the spoken.

    Each phone lasts at least one frame; silence may come before, after and between any two.
    """
    states = [SILENCE]
    for phone in phones:
        states += [phone, SILENCE]
    scores = np.maximum(log_posteriors[:, states], FRAME_LEAST)
    frames, count = scores.shape
    rests = np.arange(count) % 2 == 0
    entry = np.where(rests, -REST_COST, 0.0)
    total = np.full(count, -np.inf)
    total[:2] = scores[0, :2]
    came = np.zeros((frames, count), np.int8)
    for frame in range(1, frames):
        step = np.concatenate([[-np.inf], total[:-1]]) + entry
        skip = np.concatenate([[-np.inf, -np.inf], total[:-2]])
        skip[rests] = -np.inf  # only silences may be skipped
        options = np.stack([total, step, skip])
        came[frame] = options.argmax(axis=0)
        total = options.max(axis=0) + scores[frame]
    state = count - 1 if total[-1] > total[-2] else count - 2
    path = np.empty(frames, int)
    for frame in range(frames - 1, -1, -1):
        path[frame] = states[state]
        state -= int(came[frame, state])
    spoken = path != SILENCE
    return path, float(log_posteriors[spoken, path[spoken]].mean())


class Realigner:
    """Aligns recordings with the encoder that ships and espeak-ng."""

    def __init__(self) -> None:
        self.encoder, self.engine = builtin_encoder(), Espeak()

    def align(self, samples: np.ndarray, recording: Recording) -> np.ndarray | None:
        """(frame,) phones at 50 Hz, or None where text and sound do not fit."""
        voice = VOICES.get(recording.language, recording.language)
        _, phones = self.engine.speak(recording.text, voice, 170, 50, 50)
        seen = UVULAR if recording.language == "de" else {}
        names = [PHONES.index(seen.get(name, name)) for _, _, name in phones if name != "SIL"]
        posteriors = self.encoder.encode(samples)
        if not names or len(names) * 1.5 > len(posteriors):
            return None
        path, score = viterbi(posteriors, names)
        return path if score > WORST else None


def recordings_to_realign(data: Path) -> list[Recording]:
    """What `align` could not do: other languages, and words that are in no dictionary."""
    aligner = EnglishAligner()
    listed = [r for r in list_recordings(data) if r.text]
    return [r for r in listed if r.language != "en" or not aligner.knows(r.text)] + list_precise(
        data
    )


def realigned_shards(data: Path, work: Path, sources: list[str]) -> None:
    """Write a train and a test shard for each of `sources` (all where empty)."""
    realigner, chosen = Realigner(), recordings_to_realign(data)
    for source in sources or sorted({r.source for r in chosen}):
        writers = {"train": ShardWriter(), "test": ShardWriter()}
        refused = 0
        for recording in (r for r in chosen if r.source == source):
            samples = read(recording.path)
            path = realigner.align(samples, recording)
            if path is None:
                refused += 1
                continue
            writers[split_of(recording)].add(
                samples[: len(path) * 2 * HOP],
                np.repeat(path, 2),
                speaker=recording.speaker,
                source=recording.source,
                language=recording.language,
                text=recording.text,
                path=recording.name,
            )
        for split, writer in writers.items():
            print(source, split, len(writer.items), "realigned;", refused, "refused", flush=True)
            if writer.items:
                writer.save(work, f"own_{split}_{source}")
