"""The subspace of a corpus's motion, in coordinates that keep the distances of vertices.

Speech moves thousands of vertices along some dozens of directions. In an orthonormal basis of
their span, the squared distance of two coordinate vectors is the squared distance of all their
vertices, so a loss there is the loss over vertices, at a hundredth of the work.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float32Array
from elocute.corpus.corpus_statistics import displacement_blocks
from elocute.corpus.corpus_store import Corpus
from elocute.errors import CorpusError
from elocute.one_line_repr import one_line

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
