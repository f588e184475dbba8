"""A pinhole camera, and where the head stands before it.

The camera looks along -Z from the origin, +Y up; a head point p (m) is at R·p + t, with t about
half a metre to a few metres down -Z. Pixels: x to the right, y down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.numerics.quaternions import from_axis_angle, from_matrices, multiply, to_matrices
from elocute.numerics.rigid_alignment import nearest_rotation
from elocute.numerics.rotation_vectors import cross_matrices
from elocute.numerics.smoothing import gaussian_smoothed

Floats = NDArray[np.float64]

STEPS = 12
CONVERGED = 1e-5  # radians, and share of the distance
HUBER_MM = 3.0  # residuals beyond this pull no harder


@dataclass(frozen=True)
class Camera:
    """focal in pixels; centre (2,) in pixels."""

    focal: float
    centre: tuple[float, float]

    def project(self, points: Floats) -> Floats:
        """(…, 2) pixels of points (…, 3) m before the camera."""
        depth = -points[..., 2:]
        return self.centre + self.focal * points[..., :2] * [1, -1] / depth

    def slopes(self, points: Floats) -> Floats:
        """(…, 2, 3) pixels per metre that points (…, 3) move."""
        x, y, depth = points[..., 0], points[..., 1], -points[..., 2]
        zero = np.zeros_like(x)
        rows = [
            np.stack([np.ones_like(x), zero, x / depth], axis=-1),
            np.stack([zero, -np.ones_like(x), -y / depth], axis=-1),
        ]
        return np.stack(rows, axis=-2) * (self.focal / depth)[..., None, None]


def usual_camera(size: tuple[int, int], focal: float) -> Camera:
    """A camera for pictures of `size` (width, height); focal length in longer picture sides."""
    return Camera(focal * max(size), (size[0] / 2, size[1] / 2))


@dataclass(frozen=True, eq=False)
class Poses:
    """Where the head stands: turns (frame, 4) unit quaternions wxyz, places (frame, 3) m."""

    turns: Floats
    places: Floats

    def of(self, points: Floats) -> Floats:
        """(frame, point, 3) before the camera, of points (frame, point, 3) or (point, 3) m."""
        turned = points @ np.swapaxes(to_matrices(self.turns), -1, -2)
        return turned + self.places[:, None]

    def pixel_mm(self, camera: Camera) -> Floats:
        """(frame,) mm that one pixel measures where the head stands."""
        return 1000 * -self.places[:, 2] / camera.focal


def first_poses(camera: Camera, model: Floats, seen: Floats) -> Poses:
    """A start from the detector's own weak depth: the similarity of Umeyama (1991).

    model (point, 3) m; seen (frame, point, 3) pixels with depth.
    """
    given = seen * [1, -1, -1]
    rest = model - model.mean(axis=0)
    there = given - given.mean(axis=1, keepdims=True)
    turn, reach = nearest_rotation(np.einsum("fpa,pb->fab", there, rest))
    scale = reach / (rest**2).sum()  # pixels per metre
    depth = camera.focal / scale
    middle = seen[:, :, :2].mean(axis=1) - camera.centre
    places = np.concatenate([middle * [1, -1] / scale[:, None], -depth[:, None]], axis=1)
    places -= np.einsum("fab,b->fa", turn, model.mean(axis=0))
    return Poses(from_matrices(turn), places)


def fit_poses(
    camera: Camera, model: Floats, seen: Floats, trust: Floats, start: Poses, steps: int = STEPS
) -> Poses:
    """Turn and place the head so that its points fall on those seen; all frames at once.

    model (frame, point, 3) or (point, 3) m, seen (frame, point, 2) pixels, trust (point,).
    Gauss-Newton with Huber's weights, starting from `start`.
    """
    turns, places = start.turns.copy(), start.places.copy()
    for _ in range(steps):
        poses = Poses(turns, places)
        stands = poses.of(model)
        slopes = camera.slopes(stands)
        left = seen - camera.project(stands)
        scale = poses.pixel_mm(camera)[:, None, None]
        weight = trust * huber(np.linalg.norm(left, axis=2) * scale[:, 0])
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
    return Poses(turns, places)


def steadied(poses: Poses, frames: float) -> Poses:
    """Poses blurred over time by a Gaussian of `frames` standard deviation; the ends repeat."""
    # Neighbours on the same side of the sphere, so that means are rotations in between.
    steps = np.einsum("fq,fq->f", poses.turns[1:], poses.turns[:-1])
    sign = np.cumprod(np.concatenate([[1.0], np.where(steps < 0, -1.0, 1.0)]))
    both = np.concatenate([poses.turns * sign[:, None], poses.places], axis=1)
    calm = gaussian_smoothed(both, max(frames, 1e-6))
    turns = calm[:, :4] / np.linalg.norm(calm[:, :4], axis=1, keepdims=True)
    return Poses(turns, calm[:, 4:])


def huber(left_mm: Floats) -> Floats:
    """Huber's weights of residuals in mm."""
    return HUBER_MM / np.maximum(left_mm, HUBER_MM)
