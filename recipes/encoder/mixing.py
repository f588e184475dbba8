"""Speech mixed for training: many sources, other tempos, rooms, noises and other people."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import soundfile

from recipes.encoder.augment import CHUNK_FRAMES, Augmenter, silence_gap, stretch
from recipes.encoder.store import HOP, Shard

# How often each kind of speech is heard; speakers count for more than minutes.
MIX = {
    "espeak": 0.30,
    "flite": 0.08,
    "festival": 0.08,
    "speechocean": 0.32,
    "kathleen_en": 0.11,
    "wakeword": 0.09,
    "fsdd": 0.03,
    "kerstin_de": 0.07,
    "nathalie_nl": 0.05,
    "precise": 0.04,
    "readers": 0.25,
    "untold": 0.12,
    "nothing": 0.12,
    "voices": 0.04,
}
NOTHING_SHARE = 0.02
LIPS = ("P", "B", "M", "F", "V")


class Mixer:
    """Draws augmented chunks of CHUNK_FRAMES labels from all shards of a folder."""

    def __init__(self, shards: list[Shard], noises: list[np.ndarray], seed: int) -> None:
        self.pools: dict[str, list[tuple[Shard, int]]] = {}
        for shard in shards:
            for index, item in enumerate(shard.items):
                self.pools.setdefault(item.source, []).append((shard, index))
        self.draw = random.Random(seed)
        self.augment = Augmenter(noises, seed + 1)
        self.sources = [name for name in MIX if name in self.pools]

    def _pick(self) -> tuple[np.ndarray, np.ndarray]:
        shard, index = self.draw.choice(self.pools[self.source])
        item = shard.items[index]
        return shard.samples(item), shard.item_labels(item)

    def chunk(self) -> tuple[np.ndarray, np.ndarray]:
        self.source = self.draw.choices(self.sources, [MIX[name] for name in self.sources])[0]
        if self.draw.random() < NOTHING_SHARE:  # a room where nobody speaks
            return self.augment(*self._nothing()), np.zeros(CHUNK_FRAMES, np.uint8)
        rate = self.draw.uniform(0.82, 1.22)
        need = int(CHUNK_FRAMES * rate) + 2
        sounds, labels, have = [], [], 0
        while have < need:
            sound, label = silence_gap(self.draw) if self.draw.random() < 0.15 else self._pick()
            if have == 0 and len(label) > need + 10:
                cut = self.draw.randrange(len(label) - need)
                sound, label = sound[cut * HOP :], label[cut:]
            sound = sound * 10 ** (self.draw.uniform(-6, 6) / 20)
            sounds.append(sound)
            labels.append(label)
            have += len(label)
        sound, label = stretch(np.concatenate(sounds), np.concatenate(labels), rate)
        return self.augment(sound, self._babble(len(sound))), label

    def _nothing(self) -> tuple[np.ndarray, np.ndarray]:
        count = CHUNK_FRAMES * HOP
        return np.zeros(count, np.float32), self.augment.white(count)

    def _babble(self, count: int) -> np.ndarray:
        """A few other people at once."""
        total = np.zeros(count, np.float32)
        if self.draw.random() < 0.2:
            for _ in range(4):
                voice, _ = self._pick()
                total += np.resize(voice, count)
        else:
            total += self.augment.white(count)
        return total

    def batch(self, size: int) -> tuple[np.ndarray, np.ndarray]:
        chunks = [self.chunk() for _ in range(size)]
        return np.stack([c[0] for c in chunks]), np.stack([c[1][::2] for c in chunks])


def read_noises(paths: list[Path]) -> list[np.ndarray]:
    return [soundfile.read(path, dtype="float32")[0] for path in paths]
