"""What the trainings on a Corpus read of it: styles, the space of targets, sounds and motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from elocute.audio.waveform import Waveform
from elocute.corpus.corpus_store import Corpus
from elocute.errors import CorpusError
from elocute.training.target_space import MotionSpace, motion_space
from elocute.training.training_log import Report

LENGTH_TOLERANCE_S = 0.25  # sound may end this much before its motion

Frames = TypeVar("Frames")
Progress = Callable[[float], None]
Load = Callable[[Sequence[str], Sequence[str], MotionSpace | None, Progress | None], Frames]
"""Reads the clips of some names, given the styles, the space of targets and who is told how far."""


@dataclass(frozen=True, eq=False)
class CorpusData(Generic[Frames]):
    """What a training on a corpus reads: frames to train on and to validate on.

    space is that of the targets, None where they are vertices in mm; styles are the subjects of
    the training part; vertices is the number of vertices of the mesh.
    """

    train: Frames
    validation: Frames | None
    space: MotionSpace | None
    styles: tuple[str, ...]
    vertices: int
    fps: float


def load_parts(
    corpus: Corpus,
    split: str,
    load: Load[Frames],
    *,
    reduced: bool,
    doing: str,
    report: Report | None,
) -> CorpusData[Frames]:
    """The training and the validation part of a split, read by `load`.

    reduced: whether targets are coordinates in the span of the motion. doing: what people are told
    that is done meanwhile. Raises CorpusError for a split that the corpus lacks.
    """
    parts = corpus.split(split)
    styles = subjects_of(corpus, parts.train)
    space = motion_space(corpus, parts.train) if reduced else None

    def progress(share: float) -> None:
        if report:
            report(0.0, f"{doing}: {share:.0%}")

    train = load(parts.train, styles, space, progress)
    validation = load(parts.validation, styles, space, None) if parts.validation else None
    return CorpusData(train, validation, space, styles, corpus.vertex_count, corpus.fps)


def subjects_of(corpus: Corpus, names: Sequence[str]) -> tuple[str, ...]:
    """The subjects of some clips, in the corpus's order."""
    speaking = {corpus.entry(name).subject for name in names}
    return tuple(subject for subject in corpus.subjects if subject in speaking)


def clip_style(corpus: Corpus, name: str, styles: Sequence[str]) -> int:
    """The number of the style of a clip's speaker, -1 for a speaker without one."""
    subject = corpus.entry(name).subject
    return styles.index(subject) if subject in styles else -1


def clip_sound(corpus: Corpus, name: str) -> Waveform:
    """The sound of a clip. Raises CorpusError where it is much shorter than the motion."""
    count, sound = corpus.entry(name).frames, corpus.sound(name)
    if count / corpus.fps - sound.duration_s > LENGTH_TOLERANCE_S:
        raise CorpusError.about(
            f"clip {name}",
            found=f"{sound.duration_s:.2f} s of sound, {count / corpus.fps:.2f} s of motion",
            allowed=f"at most {LENGTH_TOLERANCE_S} s less",
            remedy="elocute corpus check",
        )
    return sound


def clip_targets(corpus: Corpus, name: str, space: MotionSpace | None) -> np.ndarray:
    """(frame, output): coordinates in the space, or vertices in mm."""
    if space is not None:
        return space.coordinates(corpus, name)
    moved = corpus.displacements(name)
    return moved.reshape(len(moved), -1) * np.float32(1000)


def check_finite(name: str, *values: np.ndarray) -> None:
    """Raise CorpusError where a clip's values are not all finite."""
    for each in values:
        finite = np.isfinite(each).reshape(len(each), -1).all(axis=1)
        if not finite.all():
            found = f"NaN or infinity in frame {int(np.argmin(finite))}"
            raise CorpusError.about(f"clip {name}", found=found, remedy="elocute corpus check")
