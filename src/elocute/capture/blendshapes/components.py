"""Components of meshes: principal directions, and components that each move a part of the face.

Principal directions come from more meshes than fit into memory. Local components minimise
½‖X − A·C‖² + λ·Σ‖c‖ over vertices of every component (Neumann et al. 2013, without their support
maps), by block coordinate descent: one component at a time is fitted to the residual of the others,
and vertices that gain less than λ by it stay still.
"""

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

    directions: (component, number) orthonormal, strongest first. strengths: (component,) singular
    values. frames: how many rows there were. energy: sum of all squared numbers, including those
    outside the directions.
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
    """Singular vectors of blocks (frame, …) stacked, in one pass, with bounded memory.

    What is known so far, each direction scaled by its strength, stands for all frames before (Levy
    and Lindenbaum 2000, sequential Karhunen-Loève).
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


ITERATIONS = 20


def localise_components(
    principal: PrincipalComponents, count: int, sparsity: float
) -> tuple[Float32Array, Float32Array]:
    """Unit shapes (component, number), strongest first, and their deviations (component,), sparse.

    sparsity: 0 to 1, the least gain of a vertex that moves, relative to a component's strongest
    one.
    """
    data = principal.directions * principal.deviations[:, None].astype(np.float32)
    shapes = data[:count].copy()
    weights = np.eye(len(data), len(shapes), dtype=np.float32)
    left = data - weights @ shapes
    for _ in range(ITERATIONS):
        for index in range(len(shapes)):
            left += np.outer(weights[:, index], shapes[index])
            weights[:, index], shapes[index] = _one(left, weights[:, index], sparsity)
            left -= np.outer(weights[:, index], shapes[index])
    lengths = np.linalg.norm(shapes, axis=1)
    strength = np.linalg.norm(weights, axis=0) * lengths
    order = np.argsort(strength)[::-1]
    order = order[strength[order] > 0]
    return shapes[order] / lengths[order, None], strength[order]


def _one(
    left: Float32Array, weight: Float32Array, sparsity: float
) -> tuple[Float32Array, Float32Array]:
    """Weights (row,) of unit length and the shape (number,) that best explain the residual."""
    weight = weight / max(float(np.linalg.norm(weight)), 1e-12)
    shape = _shrunk(weight @ left, sparsity)
    length = float(np.linalg.norm(shape))
    if length < 1e-12:
        return np.zeros_like(weight), np.zeros_like(shape)
    weight = left @ shape
    weight /= max(float(np.linalg.norm(weight)), 1e-12)
    return weight, _shrunk(weight @ left, sparsity)


def _shrunk(shape: Float32Array, sparsity: float) -> Float32Array:
    moved = shape.reshape(-1, 3)
    lengths = np.linalg.norm(moved, axis=1, keepdims=True)
    least = sparsity * float(lengths.max(initial=0))
    return (moved * np.maximum(0, 1 - least / np.maximum(lengths, 1e-12))).ravel()
