"""Aligns one set of points with another by a rotation and a shift."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array, FloatArray


def nearest_rotation(covariance: FloatArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The rotations R (..., 3, 3) that maximise trace(Rᵀ · covariance), never a mirror image.

    A covariance (..., 3, 3) is Σ target · sourceᵀ over points about their means; R then turns the
    source onto the target (Kabsch 1976). The maxima (...) come with them: divided by Σ |source|²,
    they are the scale of the similarity (Umeyama 1991, Eq. 42).
    """
    left, values, right = np.linalg.svd(np.asarray(covariance, np.float64))
    signs = np.ones(values.shape)
    signs[..., 2] = np.sign(np.linalg.det(left @ right))
    return (left * signs[..., None, :]) @ right, (values * signs).sum(axis=-1)


def rigid_alignment(
    source: FloatArray, target: FloatArray, weights: FloatArray | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rotation (3, 3) and shift (3,) for which target ≈ rotation · source + shift (Kabsch 1976).

    Points (point, 3) correspond one to one, three or more of them off one line; weights (point,)
    say how much each counts.
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
    """The similarity that brings points (point, 3) nearest to others (Umeyama 1991).

    Points correspond one to one, three or more of them off one line; weights (point,) say how much
    each counts.
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
