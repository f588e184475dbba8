"""Batches of speech: clips of a talker spliced with silences between, or stretches of sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float32Array
from elocute.articulation.contacts_and_rest import runs
from elocute.models.talker_inputs import LEVEL_COLUMN, SILENCE_COLUMN
from recipes.talkers.clips import Clip, by_talker

QUIET_LEVEL = -2.0
JOIN_ROWS = 5  # around a join nothing is learned
SILENCE_SHARE, SILENCE_ROWS = 0.6, (5, 50)  # of joins with a silence, and how long it is
LOUDER = (-0.15, 0.1)  # how a clip's level is varied, units of level
LEAST_LEFT = 20  # rows that another clip must have


@dataclass(frozen=True, eq=False)
class Batch:
    """(sequence, row, …) inputs and targets, and (sequence, row) what is to be learned."""

    inputs: Float32Array
    targets: Float32Array
    weight: Float32Array


def silent_stretches(clips: Sequence[Clip], least: int = 10) -> list[Float32Array]:
    """Inputs of real silences."""
    found = []
    for clip in clips:
        quiet = clip.inputs[:, SILENCE_COLUMN] > 0.9
        found += [clip.inputs[a:b] for a, b in runs(quiet) if b - a >= least]
    return found


class Batches:
    """Draws batches from clips; where `silences` are given, clips of a talker are spliced."""

    def __init__(
        self,
        clips: Sequence[Clip],
        rows: int,
        seed: int,
        silences: Sequence[Float32Array] | None = None,
    ) -> None:
        self._clips, self._rows, self._silences = list(clips), rows, silences
        self._of_talker = by_talker(self._clips)
        self._random = np.random.default_rng(seed)

    def draw(self, size: int) -> Batch:
        """So many sequences."""
        first = self._clips[0]
        inputs = np.zeros((size, self._rows, first.inputs.shape[1]), np.float32)
        inputs[..., SILENCE_COLUMN], inputs[..., LEVEL_COLUMN] = 1, QUIET_LEVEL
        targets = np.zeros((size, self._rows, first.targets.shape[1]), np.float32)
        weight = np.zeros((size, self._rows), np.float32)
        for place in range(size):
            self._fill(inputs[place], targets[place], weight[place])
        return Batch(inputs, targets, weight)

    def _fill(self, inputs: Float32Array, targets: Float32Array, weight: Float32Array) -> None:
        draw = self._random
        clip, at = self._clips[draw.integers(len(self._clips))], 0
        while at < self._rows - LEAST_LEFT:
            begin = int(draw.integers(0, max(1, len(clip.inputs) - self._rows + 1)))
            count = min(len(clip.inputs) - begin, self._rows - at)
            here, there = slice(at, at + count), slice(begin, begin + count)
            inputs[here] = clip.inputs[there]
            inputs[here, LEVEL_COLUMN] += draw.uniform(*LOUDER)
            targets[here] = clip.targets[there]
            weight[here] = (clip.known & clip.speaking)[there]
            if at:
                weight[max(0, at - JOIN_ROWS) : at + JOIN_ROWS] = 0
            at += count
            if self._silences is None:
                return
            if draw.random() < SILENCE_SHARE and at < self._rows - JOIN_ROWS:
                at += self._silence(inputs[at:])
                weight[max(0, at - JOIN_ROWS) : at] = 0
            others = self._of_talker[clip.talker]
            clip = others[draw.integers(len(others))]

    def _silence(self, inputs: Float32Array) -> int:
        """Write a silence at the start of `inputs`; its rows."""
        draw, silences = self._random, self._silences or []
        chosen = silences[int(draw.integers(len(silences)))]
        wanted = int(draw.integers(*SILENCE_ROWS))
        begin = int(draw.integers(0, max(1, len(chosen) - wanted + 1)))
        stretch = chosen[begin : begin + wanted][: len(inputs)]
        inputs[: len(stretch)] = stretch
        return len(stretch)
