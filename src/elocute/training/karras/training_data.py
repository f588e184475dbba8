"""What the training loop reads: autocorrelation and motion of all clips, and runs of frames.

A face is predicted for the middle of 64 rows of sound, which lies between two rows: output k of a
clip is at (k + 0.5) / 125 s. Targets are read there, linear between frames. Frames of a training
lie four outputs apart, 32 ms, about the paper's 30 a second; where a clip's first frame lies is
drawn anew in every epoch, which is the paper's random shift of up to half a frame to either side.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import embedding

from elocute.array_types import Float32Array
from elocute.audio.autocorrelation import (
    COEFFICIENTS,
    ROW_RATE,
    WINDOW_ROWS,
    autocorrelation,
    rows_in,
)
from elocute.audio.sound_level import samples_level
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.corpus.corpus_store import Corpus
from elocute.training.corpus_data import (
    CorpusData,
    MotionSpace,
    Progress,
    check_finite,
    clip_sound,
    clip_style,
    clip_targets,
    load_parts,
)
from elocute.training.epochs import Report
from elocute.training.karras.settings import KarrasTrainConfig

FRAME_OUTPUTS = 4  # outputs from frame to frame
BEFORE = WINDOW_ROWS // 2 - 1  # rows of a window up to the one before its middle, itself left out


@dataclass(frozen=True)
class ClipPlace:
    """Where a clip lies among rows, frames and emotion vectors, and whose it is.

    row: the first row of its first window. outputs: windows whose middle is within its motion.
    style: number of its speaker's style, -1 for a speaker without one.
    """

    name: str
    row: int
    outputs: int
    frame: int
    frames: int
    vector: int
    vectors: int
    style: int


@dataclass(frozen=True, eq=False)
class Runs:
    """Runs of neighbouring frames of some clips.

    rows: (run,), the first row of the first window. windows: (run, frame), the first row of each
    window, from the run's own first. places: (run, frame), where the targets lie among all frames,
    with fractions. vectors: (run, frame), where the emotional states lie among all vectors, with
    fractions.
    """

    rows: Tensor
    windows: Tensor
    places: Tensor
    vectors: Tensor

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, chosen: slice | Tensor) -> Runs:
        return Runs(*(value[chosen] for value in vars(self).values()))


@dataclass(frozen=True, eq=False)
class KarrasFrames:
    """Rows (row, 32) and targets (frame, output) of clips one after another."""

    rows: Tensor
    targets: Tensor
    clips: tuple[ClipPlace, ...]
    fps: float

    def to(self, device: torch.device) -> KarrasFrames:
        """The same frames on a device."""
        return KarrasFrames(self.rows.to(device), self.targets.to(device), self.clips, self.fps)

    def sound_of(self, runs: Runs) -> Tensor:
        """(run, row, 32): all rows that the windows of each run reach into."""
        count = WINDOW_ROWS + FRAME_OUTPUTS * (runs.windows.shape[1] - 1)
        reach = torch.arange(count, device=self.rows.device)
        return self.rows[runs.rows.to(reach.device)[:, None] + reach]

    def targets_of(self, runs: Runs) -> Tensor:
        """(run, frame, output)."""
        return read_between(self.targets, runs.places)

    def clip_rows(self, clip: ClipPlace) -> Tensor:
        """(row, 32): those of all windows of a clip."""
        return self.rows[clip.row : clip.row + clip.outputs + WINDOW_ROWS - 1]

    def clip_targets(self, clip: ClipPlace) -> Tensor:
        """(output, …): the motion where its windows have their middles."""
        return read_between(self.targets, self.target_places(clip, torch.arange(clip.outputs)))

    def target_places(self, clip: ClipPlace, outputs: Tensor) -> Tensor:
        """Where some outputs of a clip lie among all frames, with fractions."""
        at = (outputs.double() + 0.5) / ROW_RATE * self.fps
        return clip.frame + at.clamp(max=clip.frames - 1)


def read_between(values: Tensor, places: Tensor) -> Tensor:
    """Rows of (row, …) at places with fractions, linear between rows."""
    below = places.floor().clamp(0, len(values) - 1)
    share = (places - below).to(values)[..., None]
    first = below.long().to(values.device)
    after = (first + 1).clamp(max=len(values) - 1)
    # The gradient of a lookup is the same in every run; that of an index is not, on many threads.
    return embedding(first, values) * (1 - share) + embedding(after, values) * share


def draw_runs(data: KarrasFrames, config: KarrasTrainConfig, generator: torch.Generator) -> Runs:
    """Runs that cover every clip once, in a random order and randomly shifted.

    What is left of a clip when it is cut into runs is left out at random ends; a clip shorter than
    a run holds its last frame.
    """
    length = config.run_frames
    parts: list[tuple[Tensor, ...]] = []
    for clip in data.clips:
        shift, slack = torch.rand(2, generator=generator).tolist()
        phase = min(int(shift * FRAME_OUTPUTS), clip.outputs - 1)
        count = (clip.outputs - phase - 1) // FRAME_OUTPUTS + 1
        runs = max(1, count // length)
        first = int(slack * (max(0, count - runs * length) + 1))
        frames = first + torch.arange(runs * length).reshape(runs, length)
        outputs = (phase + FRAME_OUTPUTS * frames).clamp(max=clip.outputs - 1)
        vectors = clip.vector + (outputs // FRAME_OUTPUTS) / config.emotion_frames
        rows = clip.row + outputs[:, 0]
        windows = outputs - outputs[:, :1]
        parts.append((rows, windows, data.target_places(clip, outputs), vectors))
    drawn = Runs(*(torch.cat(each) for each in zip(*parts, strict=True)))
    return drawn[torch.randperm(len(drawn), generator=generator)]


def batches(runs: Runs, size: int) -> Iterator[Runs]:
    """The same runs in batches."""
    for start in range(0, len(runs), size):
        yield runs[slice(start, start + size)]


KarrasTrainingData = CorpusData[KarrasFrames]


def prepare(
    corpus: Corpus,
    config: KarrasTrainConfig,
    split: str = "default",
    report: Report | None = None,
) -> KarrasTrainingData:
    """Hold everything that a training reads in memory.

    split: its subjects in `train` become styles. Raises CorpusError for a split that the corpus
    lacks, a clip whose sound does not fit its motion, or motion that is not finite.
    """
    return load_parts(
        corpus,
        split,
        partial(load_frames, corpus, config),
        reduced=config.reduced,
        doing="analysing the corpus",
        report=report,
    )


def load_frames(
    corpus: Corpus,
    config: KarrasTrainConfig,
    names: Sequence[str],
    styles: Sequence[str],
    space: MotionSpace | None,
    progress: Progress | None = None,
) -> KarrasFrames:
    """Sound and motion of every clip; without a `space`, targets are vertices in mm.

    Raises CorpusError naming the clip where they do not fit or numbers are not finite.
    """
    rows, targets, clips = [], [], []
    row = frame = vector = 0
    for index, name in enumerate(names):
        target = clip_targets(corpus, name, space)
        check_finite(name, target)
        outputs = max(1, math.floor((len(target) - 1) / corpus.fps * ROW_RATE + 0.5))
        heard = windowed_rows(clip_sound(corpus, name), outputs)
        vectors = (outputs - 1) // FRAME_OUTPUTS // config.emotion_frames + 2
        style = clip_style(corpus, name, styles)
        clips.append(ClipPlace(name, row, outputs, frame, len(target), vector, vectors, style))
        rows.append(heard)
        targets.append(target)
        row, frame, vector = row + len(heard), frame + len(target), vector + vectors
        if progress:
            progress((index + 1) / len(names))
    rows.append(np.zeros((FRAME_OUTPUTS * config.run_frames, COEFFICIENTS), np.float32))
    return KarrasFrames(
        torch.from_numpy(np.concatenate(rows)),
        torch.from_numpy(np.concatenate(targets)),
        tuple(clips),
        corpus.fps,
    )


def windowed_rows(sound: Waveform, outputs: int) -> Float32Array:
    """(row, 32) of a sound scaled to its peak, those of the windows of so many outputs."""
    samples = sound.resample(SPEECH_RATE).samples
    _, peak = samples_level(samples)
    count = outputs + WINDOW_ROWS - 1
    known = min(count - BEFORE, rows_in(len(samples)))
    values = autocorrelation(samples / np.float32(peak), 0, known)
    return np.pad(values, ((BEFORE, count - BEFORE - known), (0, 0)))
