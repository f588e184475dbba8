"""Rotation vectors: an axis whose length is the angle in radians."""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float64Array


def cross_matrices(vectors: Float64Array) -> Float64Array:
    """(..., 3, 3) matrices that take any w to v × w, of vectors v (..., 3)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def to_matrices(vectors: Float64Array) -> Float64Array:
    """(..., 3, 3) rotation matrices of rotation vectors (..., 3) in radians.

    Rodrigues' formula, exact down to zero.
    """
    cross = cross_matrices(vectors)
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    # sin(θ)/θ and (1 - cos θ)/θ², both written as sinc, which knows its limit at zero.
    first, second = np.sinc(angle / np.pi), 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    return np.eye(3) + first * cross + second * (cross @ cross)
