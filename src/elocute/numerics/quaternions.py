"""Unit quaternions in the order w, x, y, z: to and from other forms, product and blend."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import FloatArray

IDENTITY = (1.0, 0.0, 0.0, 0.0)


def from_axis_angle(vectors: FloatArray) -> NDArray[np.float64]:
    """(..., 4) of axis-angle vectors (..., 3), whose length is the angle in radians."""
    vectors = np.asarray(vectors, np.float64)
    half = np.linalg.norm(vectors, axis=-1, keepdims=True) / 2
    # np.sinc is sin(πx)/(πx): exact at zero, where dividing by the angle is not.
    return np.concatenate([np.cos(half), np.sinc(half / np.pi) / 2 * vectors], axis=-1)


def to_axis_angle(quaternions: FloatArray) -> NDArray[np.float64]:
    """(..., 3) radians, at most π long, of unit quaternions (..., 4)."""
    quaternions = np.asarray(quaternions, np.float64)
    quaternions = np.where(quaternions[..., :1] < 0, -quaternions, quaternions)
    half = np.arctan2(np.linalg.norm(quaternions[..., 1:], axis=-1), quaternions[..., 0])[..., None]
    return 2 * quaternions[..., 1:] / np.sinc(half / np.pi)


def multiply(second: FloatArray, first: FloatArray) -> NDArray[np.float64]:
    """(..., 4): the rotation `first`, then `second`."""
    a, b, c, d = np.moveaxis(np.asarray(second, np.float64), -1, 0)
    w, x, y, z = np.moveaxis(np.asarray(first, np.float64), -1, 0)
    parts = [
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    ]
    return np.stack(parts, axis=-1)


def from_matrices(matrices: FloatArray) -> NDArray[np.float64]:
    """(..., 4) of rotation matrices (..., 3, 3), by the eigenvector that Bar-Itzhack (2000) gives.

    Exact for any angle: no case distinction on the largest diagonal entry.
    """
    m = np.asarray(matrices, np.float64)
    k = np.zeros((*m.shape[:-2], 4, 4))
    k[..., 1:, 1:] = m + np.swapaxes(m, -1, -2)
    trace = np.trace(m, axis1=-2, axis2=-1)
    k[..., 1:, 1:] -= trace[..., None, None] * np.eye(3)
    k[..., 0, 0] = trace
    skew = [m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]]
    k[..., 0, 1:] = k[..., 1:, 0] = np.stack(skew, axis=-1)
    quaternions = np.linalg.eigh(k)[1][..., -1]
    return np.where(quaternions[..., :1] < 0, -quaternions, quaternions)


def to_matrices(quaternions: FloatArray) -> FloatArray:
    """(..., 3, 3) rotation matrices of unit quaternions (..., 4), in their precision."""
    w, x, y, z = np.moveaxis(np.asarray(quaternions), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def to_euler_degrees(quaternions: FloatArray) -> NDArray[np.float64]:
    """(..., 3) degrees about x, then y, then z, all fixed, of quaternions (..., 4) of any length.

    Along the first axis each turn is next to the one before: none leaps by a whole turn.
    """
    turns = np.asarray(quaternions, np.float64)
    m = to_matrices(turns / np.linalg.norm(turns, axis=-1, keepdims=True))
    x = np.arctan2(m[..., 2, 1], m[..., 2, 2])
    y = np.arcsin(np.clip(-m[..., 2, 0], -1, 1))
    z = np.arctan2(m[..., 1, 0], m[..., 0, 0])
    return np.degrees(np.unwrap(np.stack([x, y, z], axis=-1), axis=0))


def blend(first: FloatArray, second: FloatArray, share: FloatArray) -> FloatArray:
    """Interpolate between unit quaternions wxyz by the share (..., 1) of the second, 0 to 1.

    Linearly and normalised: enough for near neighbours.

    Returns
    -------
    (..., 4)
    """
    sign = np.where((first * second).sum(-1, keepdims=True) < 0, -1.0, 1.0)
    mixed = first * (1 - share) + second * sign * share
    return mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)


def no_turn(*shape: int) -> NDArray[np.float32]:
    """(*shape, 4) quaternions of the identity rotation."""
    return np.tile(np.array(IDENTITY, np.float32), (*shape, 1))
