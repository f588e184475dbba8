"""Pinhole camera, the head's pose before it, and the linear equations of projected points.

The camera looks along -Z from the origin, +Y up; a head point p (m) is at R·p + t, with t about
half a metre to a few metres down -Z. Pixels: x to the right, y down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float64Array
from elocute.numerics.quaternions import from_axis_angle, from_matrices, multiply, to_matrices
from elocute.numerics.rigid_alignment import nearest_rotation
from elocute.numerics.rotation_vectors import cross_matrices
from elocute.numerics.smoothing import gaussian_smoothed

STEPS = 12
CONVERGED = 1e-5  # radians, and share of the distance
HUBER_MM = 3.0  # from here on the cost of a residual is linear
SIGMA_MM = 1.5
"""Standard deviation of the detector's points from where they belong."""
CORRELATED_POINTS = 2.0
"""So many neighbouring points err together that they count as one."""


@dataclass(frozen=True)
class PinholeCamera:
    """A camera without distortion: focal length, and (x, y) of the optical axis, in pixels."""

    focal: float
    centre: tuple[float, float]

    def project(self, points: Float64Array) -> Float64Array:
        """(…, 2) pixels of points (…, 3) m in front of the camera."""
        depth = -points[..., 2:]
        return self.centre + self.focal * points[..., :2] * [1, -1] / depth

    def jacobian(self, points: Float64Array) -> Float64Array:
        """(…, 2, 3) pixels per metre by which projections of points (…, 3) m move."""
        x, y, depth = points[..., 0], points[..., 1], -points[..., 2]
        zero = np.zeros_like(x)
        rows = [
            np.stack([np.ones_like(x), zero, x / depth], axis=-1),
            np.stack([zero, -np.ones_like(x), -y / depth], axis=-1),
        ]
        return np.stack(rows, axis=-2) * (self.focal / depth)[..., None, None]


def camera_for(size: tuple[int, int], focal: float) -> PinholeCamera:
    """A camera for pictures of `size` (width, height); focal length in longer picture sides."""
    return PinholeCamera(focal * max(size), (size[0] / 2, size[1] / 2))


@dataclass(frozen=True, eq=False)
class HeadPoses:
    """Where the head stands before the camera: turns (frame, 4) wxyz and places (frame, 3) m."""

    turns: Float64Array
    places: Float64Array

    def apply(self, points: Float64Array) -> Float64Array:
        """Points (frame, point, 3) or (point, 3) m in the camera's frame: (frame, point, 3) m."""
        turned = points @ np.swapaxes(to_matrices(self.turns), -1, -2)
        return turned + self.places[:, None]

    def pixel_mm(self, camera: PinholeCamera) -> Float64Array:
        """(frame,) mm per pixel at the distance of the head."""
        return 1000 * -self.places[:, 2] / camera.focal


def initial_poses(camera: PinholeCamera, model: Float64Array, seen: Float64Array) -> HeadPoses:
    """Poses from the detector's own weak depth: the similarity of Umeyama (1991).

    model: (point, 3) m. seen: (frame, point, 3) pixels with depth.
    """
    points = seen * [1, -1, -1]
    rest = model - model.mean(axis=0)
    there = points - points.mean(axis=1, keepdims=True)
    turn, reach = nearest_rotation(np.einsum("fpa,pb->fab", there, rest))
    scale = reach / (rest**2).sum()  # pixels per metre
    depth = camera.focal / scale
    middle = seen[:, :, :2].mean(axis=1) - camera.centre
    places = np.concatenate([middle * [1, -1] / scale[:, None], -depth[:, None]], axis=1)
    places -= np.einsum("fab,b->fa", turn, model.mean(axis=0))
    return HeadPoses(from_matrices(turn), places)


def fit_poses(
    camera: PinholeCamera,
    model: Float64Array,
    seen: Float64Array,
    trust: Float64Array,
    start: HeadPoses,
    steps: int = STEPS,
) -> HeadPoses:
    """Turn and place the head so that its points project onto those seen, all frames at once.

    Gauss-Newton with Huber's weights, in so many steps at most. model: (frame, point, 3) or (point,
    3) m. seen: (frame, point, 2) pixels. trust: (point,) weights.
    """
    turns, places = start.turns.copy(), start.places.copy()
    for _ in range(steps):
        poses = HeadPoses(turns, places)
        stands = poses.apply(model)
        slopes = camera.jacobian(stands)
        left = seen - camera.project(stands)
        scale = poses.pixel_mm(camera)[:, None, None]
        weight = trust * _huber_weights(np.linalg.norm(left, axis=2) * scale[:, 0])
        arms = stands - places[:, None]
        jacobian = np.concatenate([slopes @ cross_matrices(-arms), slopes], axis=-1)
        rows = jacobian.reshape(len(turns), -1, 6)
        weighted = np.swapaxes(rows * np.repeat(weight, 2, axis=1)[..., None], 1, 2)
        normal, side = weighted @ rows, weighted @ left.reshape(len(turns), -1, 1)
        step = np.linalg.solve(normal, side)[..., 0]
        turns = multiply(from_axis_angle(step[:, :3]), turns)
        turns /= np.linalg.norm(turns, axis=1, keepdims=True)
        places = places + step[:, 3:]
        moved = np.abs(step / np.repeat([1.0, np.abs(places[:, 2]).min()], 3)).max()
        if moved < CONVERGED:
            break
    return HeadPoses(turns, places)


def smooth_poses(poses: HeadPoses, frames: float) -> HeadPoses:
    """Poses smoothed over time by a Gaussian of `frames` standard deviation; the ends repeat."""
    # Neighbours on the same side of the sphere, so that means are rotations in between.
    steps = np.einsum("fq,fq->f", poses.turns[1:], poses.turns[:-1])
    sign = np.cumprod(np.concatenate([[1.0], np.where(steps < 0, -1.0, 1.0)]))
    both = np.concatenate([poses.turns * sign[:, None], poses.places], axis=1)
    calm = gaussian_smoothed(both, max(frames, 1e-6))
    turns = calm[:, :4] / np.linalg.norm(calm[:, :4], axis=1, keepdims=True)
    return HeadPoses(turns, calm[:, 4:])


def _huber_weights(left_mm: Float64Array) -> Float64Array:
    """Huber's weights of residuals in mm, any shape."""
    return HUBER_MM / np.maximum(left_mm, HUBER_MM)


def point_equations(
    camera: PinholeCamera,
    poses: HeadPoses,
    model: Float64Array,
    basis: Float64Array,
    seen: Float64Array,
    trust: Float64Array,
) -> tuple[Float64Array, Float64Array]:
    """Linear least squares of shape weights: how shapes move points in the picture.

    Weighted Jacobian (frame, 2 · point, component) and residuals (frame, 2 · point), in units of
    the detector's error, so that costs of other terms compare. model: (frame, point, 3) or (point,
    3) m, where points are now. basis: (component, point, 3) m. seen: (frame, point, 2) pixels.
    trust: (point,) weights.
    """
    stands = poses.apply(model)
    scale = poses.pixel_mm(camera)[:, None]
    left = (seen - camera.project(stands)) * scale[..., None]
    weight = (
        np.sqrt(trust * _huber_weights(np.linalg.norm(left, axis=2)) / CORRELATED_POINTS) / SIGMA_MM
    )
    lens = camera.jacobian(stands) @ to_matrices(poses.turns)[:, None]
    lens *= (scale * weight)[..., None, None]
    # (frame, point, 2, 3) @ (point, 3, component): BLAS does it point by point.
    slopes = lens @ np.transpose(basis, (1, 2, 0))
    frames, count = len(seen), len(basis)
    return slopes.reshape(frames, -1, count), (left * weight[..., None]).reshape(frames, -1)
