"""A shard of labelled speech: one run of samples, one of labels, and who spoke what where.

Labels are phones at 100 Hz: label t covers the 10 ms around t / 100 s. 255 means unknown.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from elocute.audio.waveform import SPEECH_RATE
from elocute.audio.whisper_mel import HOP
from elocute.encoders.phones_and_visemes import PHONES

RATE = SPEECH_RATE
LABEL_RATE = RATE / HOP
UNKNOWN = 255
VOICED = 254  # somebody sings or laughs: any phone but silence


@dataclass(frozen=True)
class Item:
    """`frames` labels from `start`; samples run from start * HOP."""

    speaker: str
    source: str
    language: str
    text: str
    start: int
    frames: int
    path: str = ""  # below the data folder; empty for synthetic speech


def labels_from_times(phones: list[tuple[float, float, str]], frames: int) -> np.ndarray:
    """(frame,) uint8 labels; what no phone covers is silence."""
    labels = np.full(frames, PHONES.index("SIL"), np.uint8)
    for start_s, end_s, phone in phones:
        labels[round(start_s * 100) : round(end_s * 100)] = PHONES.index(phone)
    return labels


class ShardWriter:
    """Collects utterances, then writes `NAME.audio.npy`, `NAME.labels.npy` and `NAME.json`."""

    def __init__(self) -> None:
        self.audio: list[np.ndarray] = []
        self.labels: list[np.ndarray] = []
        self.items: list[Item] = []
        self.frames = 0

    def add(
        self,
        samples: np.ndarray,
        labels: np.ndarray,
        *,
        speaker: str,
        source: str,
        language: str,
        text: str,
        path: str = "",
    ) -> None:
        """Add float samples in [-1, 1] at 16 kHz; both are cut to whole frames."""
        frames = min(len(samples) // HOP, len(labels))
        self.audio.append((np.clip(samples[: frames * HOP], -1, 1) * 32767).astype(np.int16))
        self.labels.append(labels[:frames].astype(np.uint8))
        self.items.append(Item(speaker, source, language, text, self.frames, frames, path))
        self.frames += frames

    def save(self, folder: Path, name: str) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        np.save(folder / f"{name}.audio.npy", np.concatenate(self.audio))
        np.save(folder / f"{name}.labels.npy", np.concatenate(self.labels))
        record = [asdict(item) for item in self.items]
        (folder / f"{name}.json").write_text(json.dumps(record), encoding="utf-8")


@dataclass(frozen=True)
class Shard:
    audio: np.ndarray
    labels: np.ndarray
    items: list[Item]

    def samples(self, item: Item) -> np.ndarray:
        """(sample,) float32 of one item."""
        begin = item.start * HOP
        return self.audio[begin : begin + item.frames * HOP].astype(np.float32) / 32768

    def item_labels(self, item: Item) -> np.ndarray:
        return self.labels[item.start : item.start + item.frames]


def load_shard(folder: Path, name: str) -> Shard:
    items = [Item(**r) for r in json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))]
    return Shard(
        np.load(folder / f"{name}.audio.npy", mmap_mode="r"),
        np.load(folder / f"{name}.labels.npy", mmap_mode="r"),
        items,
    )
