"""How well a basis represents faces it was not learned from (in the wild 2019, 6.3)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array, Float64Array
from elocute.corpus.corpus_store import Corpus
from elocute.errors import CorpusError
from elocute.numerics.ridge import with_ridge

BLOCK_FRAMES = 256
RIDGE = 1e-9  # of the greatest eigenvalue: shapes that are dependent


@dataclass(frozen=True, eq=False)
class ReconstructionErrors:
    """Errors of one basis.

    Attributes
    ----------
    name
        Of the basis.
    components
        How many shapes it has.
    errors_mm
        (frame,) mean distance of vertices between a mesh and its projection.
    """

    name: str
    components: int
    errors_mm: Float64Array

    @property
    def mean_mm(self) -> float:
        return float(self.errors_mm.mean())


class BasisProjection:
    """Least-squares projection onto shapes (component, vertex, 3) m."""

    def __init__(self, name: str, shapes: Float32Array) -> None:
        self.name = name
        self.flat = shapes.reshape(len(shapes), -1).astype(np.float64)
        gram = self.flat @ self.flat.T
        values, vectors = np.linalg.eigh(gram)
        kept = values > max(float(values.max(initial=0)), 1e-300) * RIDGE
        # Orthonormal directions of the span, so that projecting needs no solving.
        self.directions = (vectors[:, kept] / np.sqrt(values[kept])).T @ self.flat

    def errors_mm(self, displacements: Float32Array) -> Float64Array:
        """(frame,) mean distance of vertices in mm of (frame, vertex, 3) m."""
        flat = displacements.reshape(len(displacements), -1).astype(np.float64)
        left = flat - (flat @ self.directions.T) @ self.directions
        lengths = np.linalg.norm(left.reshape(len(flat), -1, 3), axis=2)
        return lengths.mean(axis=1) * 1000


def reconstruction_errors(
    corpus: Corpus,
    names: Sequence[str],
    bases: Sequence[BasisProjection],
    progress: Callable[[float], None] | None = None,
) -> list[ReconstructionErrors]:
    """Project every frame of some clips onto every basis.

    Parameters
    ----------
    corpus
        With meshes of the bases' topology.
    names
        Of the clips.
    bases
        To be compared.
    progress
        Called with the share of the clips that are done, 0 to 1.

    Returns
    -------
    Errors of each basis, in the order given.

    Raises
    ------
    CorpusError
        Where a basis has another number of vertices.
    """
    for basis in bases:
        if basis.flat.shape[1] != corpus.vertex_count * 3:
            raise CorpusError.about(
                f"basis {basis.name}",
                found=f"{basis.flat.shape[1] // 3} vertices",
                allowed=f"{corpus.vertex_count}, as {corpus.folder} has",
            )
    errors: list[list[Float64Array]] = [[] for _ in bases]
    for done, name in enumerate(names, 1):
        for start in range(0, corpus.entry(name).frames, BLOCK_FRAMES):
            block = corpus.displacements(name, start, start + BLOCK_FRAMES)
            for basis, of_basis in zip(bases, errors, strict=True):
                of_basis.append(basis.errors_mm(block))
        if progress:
            progress(done / len(names))
    return [
        ReconstructionErrors(basis.name, len(basis.flat), np.concatenate(of_basis))
        for basis, of_basis in zip(bases, errors, strict=True)
    ]


def strongest_shapes(
    corpus: Corpus, names: Sequence[str], shapes: Float32Array, count: int
) -> NDArray[np.intp]:
    """The shapes of a basis that together explain some clips best, added greedily one after
    another.

    For comparing bases at equal numbers of components. Orthogonal matching pursuit on the
    covariance of the clips in the span of the basis.

    Parameters
    ----------
    corpus, names
        The clips.
    shapes
        (component, vertex, 3) m.
    count
        How many to choose.

    Returns
    -------
    (count,) ascending indices.
    """
    flat = shapes.reshape(len(shapes), -1).astype(np.float64)
    cross = np.zeros((len(flat), len(flat)))
    for name in names:
        moved = corpus.displacements(name).reshape(corpus.entry(name).frames, -1)
        seen = moved @ flat.T.astype(np.float32)
        cross += seen.T.astype(np.float64) @ seen
    gram = flat @ flat.T
    chosen: list[int] = []
    while len(chosen) < min(count, len(flat)):
        chosen.append(
            max(
                set(range(len(flat))) - set(chosen),
                key=lambda i: _energy(gram, cross, [*chosen, i]),
            )
        )
    return np.array(sorted(chosen), np.intp)


def _energy(gram: Float64Array, cross: Float64Array, chosen: list[int]) -> float:
    """Squared displacement captured by the span of some shapes: tr(G⁻¹·C) over them."""
    part = np.ix_(chosen, chosen)
    steadied = with_ridge(gram[part], RIDGE * len(chosen))
    return float(np.trace(np.linalg.solve(steadied, cross[part])))
