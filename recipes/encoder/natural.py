"""Natural speech of the data folder: listing, splitting by speaker, forced alignment."""

from __future__ import annotations

import csv
import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import soundfile
import soxr

from elocute.speech.text.forced_alignment import PAD_S, EnglishAligner
from recipes.encoder.store import HOP, RATE, ShardWriter, labels_from_times

# Whole speakers for testing. The German and the Dutch corpus have one speaker each: of kerstin
# an eighth of the sentences is held out (said so in the card); ljspeech tests as a whole.
TEST_SPEAKERS = {"theo", "lucas"}
TEST_SOURCES = {"ami", "ljspeech_a", "ljspeech_b"}
TEST_SHARE = 0.12
PRECISE_TEXTS = {
    "athena": ("athena", "en"),
    "amelia": ("amelia", "en"),
    "computer": ("computer", "en"),
    "heysavant__wake-word": ("hey savant", "en"),
    "heysavant__not-wake-words__en__HeyVermont": ("hey vermont", "en"),
    "heysavant__not-wake-words__en__HesDistraught": ("he's distraught", "en"),
    "heychatterbox": ("hey chatterbox", "en"),
    "heycomputer__en": ("hey computer", "en"),
    "heycomputer__es": ("hey computer", "en"),
}


@dataclass(frozen=True)
class Recording:
    path: Path
    source: str
    speaker: str
    language: str
    text: str
    phones: str

    @property
    def name(self) -> str:
        """Folder and file, as below `speech/`."""
        return f"{self.path.parent.name}/{self.path.name}"


def list_recordings(data: Path) -> list[Recording]:
    """Every row of `speech/transcripts.tsv`."""
    with (data / "speech" / "transcripts.tsv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE))
    return [
        Recording(
            data / row["path"],
            row["path"].split("/")[1],
            row["speaker"],
            row["language"],
            row["text"] or "",
            row["phones"] or "",
        )
        for row in rows
    ]


def list_precise(data: Path) -> list[Recording]:
    """The wake words of `speech/precise`, which has no transcripts but names its folders."""
    return [
        Recording(path, "precise", "", language, text, "")
        for start, (text, language) in PRECISE_TEXTS.items()
        for path in sorted((data / "speech" / "precise").glob(f"{start}__*.ogg"))
    ]


def split_of(recording: Recording) -> str:
    """`train` or `test`, by a hash of the speaker; by sentence for kerstin alone."""
    if recording.source in TEST_SOURCES or recording.speaker in TEST_SPEAKERS:
        return "test"
    if recording.source in ("kathleen_en", "nathalie_nl", "fsdd"):
        return "train"
    key = recording.path.name if recording.speaker == "kerstin" else recording.speaker
    share = int(hashlib.sha256(key.encode()).hexdigest()[:8], 16) / 0xFFFFFFFF
    return "test" if share < TEST_SHARE else "train"


def read(path: Path) -> np.ndarray:
    """(sample,) float32 at 16 kHz with faint noise around."""
    samples, rate = soundfile.read(path, dtype="float32", always_2d=True)
    samples = samples.mean(axis=1)
    if rate != RATE:
        samples = soxr.resample(samples, rate, RATE)
    pad = np.random.default_rng(len(samples)).normal(0, 1e-5, round(PAD_S * RATE))
    return np.concatenate([pad, samples, pad[::-1]]).astype(np.float32)


def aligned_shard(recordings: list[Recording], folder: Path, name: str) -> int:
    """Align English recordings by their text; returns how many fitted."""
    aligner, writer = EnglishAligner(), ShardWriter()
    for recording in recordings:
        samples = read(recording.path)
        phones = aligner.align(samples, recording.text)
        if phones:
            labels = labels_from_times(phones, len(samples) // HOP)
            writer.add(
                samples,
                labels,
                speaker=recording.speaker,
                source=recording.source,
                language=recording.language,
                text=recording.text,
                path=recording.name,
            )
    if writer.items:
        writer.save(folder, name)
    return len(writer.items)
