"""Recordings of talkers with what their tracked mouths did, and sequences spliced from them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elocute.array_types import Float32Array, Float64Array
from elocute.audio.read import read_audio
from elocute.audio.waveform import SPEECH_RATE
from elocute.evaluation.tracked_mouths import find_tracked_mouths, read_tracked_mouth
from elocute.files.array_reading import read_npz
from elocute.files.reading import FileKind
from recipes.encoder.augment import Augmenter

MOUTH_FILE = FileKind("a tracked mouth", 16_000_000)
FIELDS = ("inner_opening_mean", "lip_width", "protrusion", "jaw", "upper_lip", "lower_lip")
"""Of a tracked mouth, in the order of the trunk's answers; whether lips are shut comes last."""
ROW_RATE, ROW_SAMPLES = 50.0, 320
FRAMES_MIN, STILL = 12, 1e-3
CLOSED_SHARE = 0.12  # of a talker's range of openings, below which lips count as shut
LOWEST, HIGHEST = 3, 90  # percentiles that bound the range
MOST = 4.0  # deviations
GAP_SHARE, GAP_ROWS = 0.6, (4, 50)  # of joins with a pause, and how long it is
LEAST_LEFT = 25  # rows that another clip must have


@dataclass(eq=False)
class MouthClip:
    """One recording.

    Attributes
    ----------
    name, talker : str
        Of the recording, and who speaks.
    samples : (sample,) float32
        At 16 kHz.
    times_s : (frame,) float64
        Of tracked frames, with the offset of the recording taken out.
    tracked : (frame, field) float64
        `FIELDS`, in units of the outer eye-corner distance.
    targets : (row, field + 1) float32
        Deviations from the talker's mean, and 1 where the lips are shut.
    known : (row,) bool
        Where there are targets.
    """

    name: str
    talker: str
    samples: Float32Array
    times_s: Float64Array
    tracked: Float64Array
    targets: Float32Array
    known: np.ndarray


def read_mouths(folder: Path, leave_out: Iterable[str] = ()) -> list[MouthClip]:
    """All usable recordings of a folder, in either layout of `elocute evaluate real`."""
    skipped, clips = set(leave_out), []
    for found in find_tracked_mouths(folder):
        if found.path.stem in skipped:
            continue
        fields = read_npz(found.path, MOUTH_FILE, only=frozenset((*FIELDS, "t", "valid")))
        if "valid" not in fields:
            continue
        tracked = np.stack([np.asarray(fields[name], float) for name in FIELDS], axis=1)
        seen = (np.asarray(fields["valid"]) > 0) & np.isfinite(tracked).all(axis=1)
        if seen.sum() < FRAMES_MIN or tracked[seen, 0].std() < STILL:
            continue
        sound = read_audio(read_tracked_mouth(found).sound, sample_rate=SPEECH_RATE).samples
        rows = -(-len(sound) // ROW_SAMPLES)
        samples = np.pad(sound, (0, rows * ROW_SAMPLES - len(sound))).astype(np.float32)
        times_s = np.asarray(fields["t"], float)[seen] - found.offset_s
        clips.append(
            MouthClip(
                found.path.stem,
                found.talker,
                samples,
                times_s,
                tracked[seen],
                np.zeros((0, 0), np.float32),
                np.zeros(0, np.bool_),
            )
        )
    return clips


def by_talker(clips: Iterable[MouthClip]) -> dict[str, list[MouthClip]]:
    """Clips of each talker."""
    grouped: dict[str, list[MouthClip]] = defaultdict(list)
    for clip in clips:
        grouped[clip.talker].append(clip)
    return grouped


@dataclass(frozen=True, eq=False)
class TalkerMouth:
    """Mean and deviation of a talker's fields, and the gap below which the lips are shut."""

    mean: Float64Array
    deviation: Float64Array
    shut: float


def standardise(clips: Sequence[MouthClip]) -> dict[str, TalkerMouth]:
    """Set every clip's targets; returns what each talker's mouth is like."""
    talkers = {}
    for talker, own in by_talker(clips).items():
        tracked = np.concatenate([clip.tracked for clip in own])
        low, high = np.percentile(tracked[:, 0], [LOWEST, HIGHEST])
        like = TalkerMouth(
            tracked.mean(axis=0), tracked.std(axis=0) + 1e-6, low + CLOSED_SHARE * (high - low)
        )
        talkers[talker] = like
        for clip in own:
            _set_targets(clip, like)
    return talkers


def _set_targets(clip: MouthClip, like: TalkerMouth) -> None:
    times = np.arange(len(clip.samples) // ROW_SAMPLES) / ROW_RATE
    rows = np.stack([np.interp(times, clip.times_s, column) for column in clip.tracked.T], axis=1)
    deviations = np.clip((rows - like.mean) / like.deviation, -MOST, MOST)
    padded = np.pad(rows[:, 0], 1, mode="edge")
    nearby = np.minimum(np.minimum(padded[:-2], padded[1:-1]), padded[2:])
    clip.targets = np.column_stack([deviations, nearby < like.shut]).astype(np.float32)
    clip.known = (times >= clip.times_s[0] - 0.01) & (times <= clip.times_s[-1] + 0.01)


@dataclass(frozen=True, eq=False)
class MouthBatch:
    """(sequence, sample) sounds, (sequence, row, field + 1) targets and (sequence, row) the clip
    that a row belongs to, -1 where nothing is known."""

    waves: Float32Array
    targets: Float32Array
    clip: np.ndarray


class MouthBatches:
    """Draws sequences: clips of one talker, one after another, with pauses between."""

    def __init__(
        self, clips: Sequence[MouthClip], augment: Augmenter, rows: int, seed: int
    ) -> None:
        self._clips, self._augment, self._rows = list(clips), augment, rows
        self._of_talker = by_talker(self._clips)
        self._random = np.random.default_rng(seed)

    def draw(self, size: int) -> MouthBatch:
        """So many sequences."""
        waves, targets, numbers, count = [], [], [], 0
        for _ in range(size):
            wave, target, number = self._sequence(count)
            count = max(count, int(number.max()) + 1)
            waves.append(self._augment(wave, self._babble(len(wave))))
            targets.append(target)
            numbers.append(number)
        return MouthBatch(np.stack(waves), np.stack(targets), np.stack(numbers))

    def _sequence(self, number: int) -> tuple[Float32Array, Float32Array, np.ndarray]:
        draw, rows = self._random, self._rows
        wave = (10 ** draw.uniform(-6, -3.5) * self._augment.white(rows * ROW_SAMPLES)).astype(
            np.float32
        )
        targets = np.zeros((rows, len(FIELDS) + 1), np.float32)
        belongs = np.full(rows, -1)
        clip, at = self._clips[draw.integers(len(self._clips))], int(draw.integers(0, 30))
        while at < rows - LEAST_LEFT:
            begin = int(draw.integers(0, max(1, len(clip.known) - rows + 1)))
            count = min(len(clip.known) - begin, rows - at)
            here, there = slice(at, at + count), slice(begin, begin + count)
            sound = clip.samples[begin * ROW_SAMPLES : (begin + count) * ROW_SAMPLES]
            wave[at * ROW_SAMPLES : (at + count) * ROW_SAMPLES] += sound
            targets[here] = clip.targets[there]
            belongs[here] = np.where(clip.known[there], number, -1)
            number, at = number + 1, at + count
            if draw.random() < GAP_SHARE:
                at += int(draw.integers(*GAP_ROWS))
            others = self._of_talker[clip.talker]
            clip = others[draw.integers(len(others))]
        return wave, targets, belongs

    def _babble(self, count: int) -> Float32Array:
        """Somebody else, as may be heard behind a voice."""
        other = self._clips[self._random.integers(len(self._clips))]
        return np.resize(other.samples, count)
