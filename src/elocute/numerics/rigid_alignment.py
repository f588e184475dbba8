"""Aligns one set of points with another by a rotation and a shift."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array, FloatArray


def nearest_rotation(covariance: FloatArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The rotation R that maximises trace(Rᵀ · covariance), never a mirror image.

    Parameters
    ----------
    covariance
        (..., 3, 3): Σ target · sourceᵀ over points about their means; R then turns the source
        onto the target.

    Returns
    -------
    (..., 3, 3) rotations, and (...) the maxima: divided by Σ |source|², the scale of the
    similarity (Umeyama 1991, Eq. 42).

    References
    ----------
    Kabsch (1976), A solution for the best rotation to relate two sets of vectors.
    """
    left, values, right = np.linalg.svd(np.asarray(covariance, np.float64))
    signs = np.ones(values.shape)
    signs[..., 2] = np.sign(np.linalg.det(left @ right))
    return (left * signs[..., None, :]) @ right, (values * signs).sum(axis=-1)


def rigid_alignment(
    source: FloatArray, target: FloatArray, weights: FloatArray | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rotation and shift that bring points nearest to others: target ≈ rotation · source + shift.

    Parameters
    ----------
    source, target
        (point, 3) in one unit, point for point; three points or more off one line.
    weights
        (point,) how much each counts, or None for all alike.

    Returns
    -------
    Rotation (3, 3), and shift (3,) in the unit of the points.

    References
    ----------
    Kabsch (1976), weighted.
    """
    shares = np.full(len(source), 1 / len(source)) if weights is None else weights / weights.sum()
    middle, goal = shares @ source, shares @ target
    rotation, _ = nearest_rotation((target - goal).T @ (shares[:, None] * (source - middle)))
    return rotation, goal - rotation @ middle


@dataclass(frozen=True, eq=False)
class Similarity:
    """x → scale · rotation · x + shift."""

    rotation: Float64Array
    scale: float
    shift: Float64Array

    def __call__(self, points: Float64Array) -> Float64Array:
        return self.scale * points @ self.rotation.T + self.shift


def similarity_between(
    source: Float64Array, target: Float64Array, weights: Float64Array
) -> Similarity:
    """The similarity that brings points nearest to others (Umeyama 1991).

    Parameters
    ----------
    source, target
        (point, 3) in one unit, point for point; three points or more off one line.
    weights
        (point,) how much each counts.
    """
    shares = weights / weights.sum()
    middle, goal = shares @ source, shares @ target
    near = source - middle
    rotation, most = nearest_rotation((target - goal).T @ (shares[:, None] * near))
    scale = float(most / (shares @ np.square(near).sum(axis=1)))
    return Similarity(rotation, scale, goal - scale * rotation @ middle)


def turned_degrees(rotation: FloatArray) -> float:
    """The angle, 0 to 180 degrees, by which a rotation (3, 3) turns."""
    cosine = (np.trace(rotation) - 1) / 2
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
