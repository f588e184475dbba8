"""Components that each move a part of the face instead of all of it.

Minimises ½‖X − A·C‖² + λ·Σ‖c‖ over vertices of every component (Neumann et al. 2013, without
their support maps), by block coordinate descent: one component at a time is fitted to the
residual of the others, and vertices that gain less than λ by it stay still.
"""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float32Array
from elocute.capture.blendshapes.principal_components import PrincipalComponents

ITERATIONS = 20


def localise_components(
    principal: PrincipalComponents, count: int, sparsity: float
) -> tuple[Float32Array, Float32Array]:
    """Sparse components from principal ones.

    Parameters
    ----------
    principal
        The motion as its strongest directions.
    count
        How many components.
    sparsity
        0 to 1: the least gain of a vertex that moves, relative to a component's strongest vertex.

    Returns
    -------
    Unit shapes (component, number) and their deviations (component,), strongest first.
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
