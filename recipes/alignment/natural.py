"""Digits and short phrases by natural speakers, their phones by forced alignment.

fsdd and wakeword of the data folder: for each text some speakers, two takes of each at most, cut
to what is said. Forced alignment errs itself by some hundredths of a second: what methods differ
by counts here, not how small their errors get.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from pathlib import Path

from recipes.alignment.speak import Saying, save, trimmed
from recipes.encoder.natural import EnglishAligner, Recording, list_recordings, read

SOURCES = ("fsdd", "wakeword")
TAKES, PER_SPEAKER = 10, 2
LEAST_TAKES = 6
LONGEST_S = 2.5
TEXTS_MAX = 24


def natural_words(data: Path, folder: Path) -> None:
    """Write FOLDER/TEXT/NAME.wav and .json, unless they are there."""
    if folder.is_dir():
        return
    said: dict[str, list[Recording]] = defaultdict(list)
    for recording in list_recordings(data):
        if recording.source in SOURCES and recording.text:
            said[recording.text.strip().lower()].append(recording)
    aligner = EnglishAligner()
    most = sorted(said, key=lambda text: -len({r.speaker for r in said[text]}))
    for text in most[:TEXTS_MAX]:
        takes = _aligned(aligner, text, said[text])
        if len(takes) >= LEAST_TAKES:
            room = folder / text.replace(" ", "-")
            room.mkdir(parents=True)
            for name, saying in takes.items():
                save(room / f"{name}.wav", saying)


def _aligned(aligner: EnglishAligner, text: str, recordings: list[Recording]) -> dict[str, Saying]:
    takes: dict[str, Saying] = {}
    heard: Counter[str] = Counter()
    for recording in recordings:
        if len(takes) == TAKES or heard[recording.speaker] == PER_SPEAKER:
            continue
        samples = read(recording.path)
        phones = [p for p in aligner.align(samples, text) or [] if p[2] != "SIL"]
        if phones and phones[-1][1] - phones[0][0] <= LONGEST_S:
            heard[recording.speaker] += 1
            takes[recording.path.stem] = trimmed(samples, phones, None)
    return takes
