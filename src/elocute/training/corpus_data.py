"""What the trainings on a Corpus read of it: styles, the space of targets, sounds and motion.

Speech moves thousands of vertices along some dozens of directions. In an orthonormal basis of
their span, the squared distance of two coordinate vectors is the squared distance of all their
vertices, so a loss there is the loss over vertices, at a hundredth of the work.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.waveform import Waveform
from elocute.corpus.corpus_statistics import displacement_blocks
from elocute.corpus.corpus_store import Corpus
from elocute.errors import CorpusError
from elocute.one_line_repr import one_line
from elocute.training.epochs import Report

DIRECTIONS_MAX = 400
NEGLIGIBLE = 1e-7  # of the greatest singular value: numerical noise


@dataclass(frozen=True, eq=False)
class MotionSpace:
    """basis (direction, 3 · vertex), orthonormal; a coordinate is in millimetres.

    to_weights (direction, component) takes coordinates to weights of the corpus's own basis,
    None where its frames are vertices.
    """

    basis: Float32Array
    to_weights: Float32Array | None
    from_weights: Float32Array | None

    __repr__ = one_line

    @property
    def size(self) -> int:
        return len(self.basis)

    def coordinates(self, corpus: Corpus, name: str) -> Float32Array:
        """(frame, direction) mm of a clip's displacements."""
        if self.from_weights is not None:
            return np.asarray(corpus.frames(name)) @ self.from_weights
        blocks = [
            block.reshape(len(block), -1) @ self.basis.T * np.float32(1000)
            for block in displacement_blocks(corpus, [name])
        ]
        return np.concatenate(blocks)

    def displacements(self, coordinates: Float32Array) -> Float32Array:
        """(frame, vertex, 3) m."""
        return (coordinates @ self.basis / np.float32(1000)).reshape(len(coordinates), -1, 3)


def motion_space(
    corpus: Corpus, names: Sequence[str], directions: int = DIRECTIONS_MAX
) -> MotionSpace:
    """The span of some clips. Raises CorpusError where nothing moves."""
    if corpus.basis is not None:
        return _space_of_basis(corpus)
    basis = np.zeros((0, corpus.vertex_count * 3), np.float32)
    strength = np.zeros(0, np.float32)
    for block in displacement_blocks(corpus, names):
        # Incremental SVD: the known directions scaled by their singular values, and the new frames.
        stacked = np.concatenate([basis * strength[:, None], block.reshape(len(block), -1)])
        strength, basis = _directions(stacked, directions)
    if not len(basis):
        raise CorpusError.about(corpus.folder, found="nothing moves", allowed="clips of speech")
    return MotionSpace(basis, None, None)


def _directions(rows: Float32Array, count: int) -> tuple[Float32Array, Float32Array]:
    """Singular values and right singular vectors of (row, number) by the small Gram matrix."""
    gram = rows.astype(np.float64) @ rows.T.astype(np.float64)
    values, vectors = np.linalg.eigh(gram)
    order = np.argsort(values)[::-1][:count]
    kept = order[values[order] > max(values.max(), 0) * NEGLIGIBLE**1.5 + 1e-20]
    strength = np.sqrt(values[kept])
    basis = (vectors[:, kept] / strength).T @ rows
    return strength.astype(np.float32), basis.astype(np.float32)


def _space_of_basis(corpus: Corpus) -> MotionSpace:
    assert corpus.basis is not None
    flat = np.asarray(corpus.basis, np.float64).reshape(len(corpus.basis), -1)
    values, vectors = np.linalg.eigh(flat @ flat.T)
    kept = values > values.max() * NEGLIGIBLE
    if not kept.any():
        raise CorpusError.about(corpus.folder, found="a basis of zeros", allowed="shapes that move")
    strength, vectors = np.sqrt(values[kept]), vectors[:, kept]
    basis = (vectors / strength).T @ flat
    return MotionSpace(
        basis.astype(np.float32),
        to_weights=(vectors / strength / 1000).T.astype(np.float32),
        from_weights=(vectors * strength * 1000).astype(np.float32),
    )


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
            fault = f"NaN or infinity in frame {int(np.argmin(finite))}"
            raise CorpusError.about(f"clip {name}", found=fault, remedy="elocute corpus check")
