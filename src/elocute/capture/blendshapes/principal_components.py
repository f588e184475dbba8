"""Principal directions of more meshes than fit into memory."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.one_line_repr import one_line

OVERSAMPLING = 4  # directions kept while blocks come in, for each one wanted
KEPT_LEAST = 96
NEGLIGIBLE = 1e-14  # of the greatest squared singular value


@dataclass(frozen=True, eq=False)
class PrincipalComponents:
    """Directions about the origin, which is the neutral face: no motion has no weight.

    Attributes
    ----------
    directions
        (component, number) orthonormal, strongest first.
    strengths
        (component,) singular values.
    frames
        How many rows there were.
    energy
        Sum of all squared numbers, including those outside the directions.
    """

    directions: Float32Array
    strengths: NDArray[np.float64]
    frames: int
    energy: float

    __repr__ = one_line

    @property
    def deviations(self) -> NDArray[np.float64]:
        """(component,) root mean square of a frame along each direction."""
        return self.strengths / np.sqrt(max(self.frames, 1))

    @property
    def explained(self) -> NDArray[np.float64]:
        """(component,) share of the squared displacement explained by the directions so far."""
        return np.cumsum(self.strengths**2) / max(self.energy, 1e-300)


def principal_directions(blocks: Iterable[NDArray[np.floating]], count: int) -> PrincipalComponents:
    """Singular vectors of stacked blocks in one pass, with bounded memory.

    What is known so far, each direction scaled by its strength, stands for all frames before.

    Parameters
    ----------
    blocks
        (frame, …) displacements from the neutral face.
    count
        How many directions.

    References
    ----------
    Levy and Lindenbaum (2000), sequential Karhunen-Loève.
    """
    kept = max(KEPT_LEAST, OVERSAMPLING * count)
    directions, strengths = None, np.zeros(0)
    frames, energy = 0, 0.0
    for block in blocks:
        rows = block.reshape(len(block), -1).astype(np.float32, copy=False)
        frames += len(rows)
        energy += float(np.einsum("ij,ij->", rows, rows, dtype=np.float64))
        if directions is not None:
            rows = np.concatenate([directions * strengths[:, None].astype(np.float32), rows])
        directions, strengths = _strongest(rows, kept)
    if directions is None:
        return PrincipalComponents(np.zeros((0, 0), np.float32), strengths, 0, 0.0)
    return PrincipalComponents(directions[:count], strengths[:count], frames, energy)


def _strongest(rows: Float32Array, count: int) -> tuple[Float32Array, NDArray[np.float64]]:
    """Right singular vectors and values of (row, number) by the small Gram matrix."""
    wide = rows.astype(np.float64)
    values, vectors = np.linalg.eigh(wide @ wide.T)
    order = np.argsort(values)[::-1][:count]
    order = order[values[order] > max(float(values.max()), 1e-300) * NEGLIGIBLE]
    strengths = np.sqrt(values[order])
    return ((vectors[:, order] / strengths).T @ wide).astype(np.float32), strengths
