"""Fits the pose of the head and the weights of its shapes to every frame.

Weights are a sparse, non-negative least squares with costs that decide between shapes which look
alike: a ridge per shape, smoothness over time and symmetry of left and right.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float64Array
from elocute.capture.video.camera_fit import (
    HeadPoses,
    fit_poses,
    initial_poses,
    point_equations,
    smooth_poses,
)
from elocute.capture.video.face_mesh_points import FacePoints, point_trust
from elocute.capture.video.face_tracking import FaceTrack
from elocute.capture.video.lip_and_lid_contact import (
    add_lid_equations,
    add_lip_equations,
    close_lids,
    close_lips,
    fitted_lip_gaps,
    lid_gaps,
    lid_openness,
    target_lip_gap,
)
from elocute.capture.video.person_fit import Person
from elocute.head.mediapipe_face_mesh import EYE_CORNERS, IRIS, LIPS
from elocute.numerics.bounded_least_squares import solve_box_chain

ROUNDS = 2  # of poses and weights, alternating
BLOCK = 64  # frames whose Jacobians are in memory at once
POSE_S = 0.03  # standard deviation of the smoothing of head poses
MOBILE = 0.05  # trust in lips and jaw while the head is first placed

# Not visible in points on the skin: the tongue, cheeks puffed towards the camera.
UNOBSERVED = ("tongueOut", "tongueTipUp", "tongueDental", "cheekPuff")

RIDGE_COST = 4.0
"""Cost of a squared weight, in variances of the detector's error: decides between shapes that look
alike."""
L1_COST = 1.5
"""Cost of a weight itself (lasso): small ones vanish."""
SMOOTHNESS_COST = 2.0
"""Cost of a squared change between two frames at 25 Hz."""
# Shapes hard to tell from others by the points of one picture cost more, those that are seen less.
RIDGE_FACTORS = {
    "mouthLowerDownLeft": 0.5,
    "mouthLowerDownRight": 0.5,
    "mouthLabiodental": 15.0,
    "mouthShrugUpper": 10.0,
    "mouthShrugLower": 8.0,
    "jawForward": 20.0,
    "mouthClose": 2.0,
    "jawLeft": 4.0,
    "jawRight": 4.0,
    "mouthLeft": 2.0,
    "mouthRight": 2.0,
    "cheekSquintLeft": 6.0,
    "cheekSquintRight": 6.0,
    "noseSneerLeft": 4.0,
    "noseSneerRight": 4.0,
    "mouthDimpleLeft": 3.0,
    "mouthDimpleRight": 3.0,
    "mouthFrownLeft": 2.0,
    "mouthFrownRight": 2.0,
    "eyeBlinkLeft": 0.5,
    "eyeBlinkRight": 0.5,
    "eyeSquintLeft": 12.0,
    "eyeSquintRight": 12.0,
    "eyeWideLeft": 3.0,
    "eyeWideRight": 3.0,
}
# What moves slowly, by the beginning of its name.
SMOOTHNESS_FACTORS = {
    "brow": 25.0,
    "eyeLook": 6.0,
    "eyeSquint": 15.0,
    "eyeWide": 15.0,
    "eyeBlink": 0.5,
    "cheek": 8.0,
    "nose": 8.0,
    "jawForward": 4.0,
}
# Both sides move nearly alike: cost of a squared difference, by the beginning of the name.
SYMMETRY_COSTS = {"eyeBlink": 30.0, "eyeSquint": 10.0, "eyeWide": 10.0, "brow": 10.0, "mouth": 3.0}
GAZE_SYMMETRY_COST = 60.0  # both look the same way


@dataclass(frozen=True, eq=False)
class FittedFrames:
    """What a video shows, frame by frame.

    weights: (frame, component) of the head's shapes, 0 to 1. poses: the head before the camera.
    miss: (frame, 478) distance of the model's points from those seen, in eye distances.
    """

    weights: Float64Array
    poses: HeadPoses
    miss: Float64Array

    @property
    def lip_miss(self) -> Float64Array:
        """(frame,) mean over the points of the lips."""
        return self.miss[:, list(LIPS)].mean(axis=1)


def fit_frames(
    person: Person,
    table: FacePoints,
    track: FaceTrack,
    progress: Callable[[float], None] | None = None,
) -> FittedFrames:
    """Fit poses and weights to all frames of a track.

    The detector's constant offsets (`person.bias`) are taken away first, so a face at rest has
    weights near zero. Lips tracked as closed are closed on the head. table: where the points lie on
    the head. progress: called with the share of the work that is done, 0 to 1.
    """
    head = person.head
    names = _observed_shapes(head.expression_names)
    columns = [head.expression_index(name) for name in names]
    basis, rest = table.on(head.expression_basis[columns]), table.on(head.template)
    seen, trust = track.points[..., :2], point_trust(table)
    model = rest + person.bias
    poses = initial_poses(person.camera, rest[:IRIS], track.points[:, :IRIS])
    calm = trust * np.where(np.abs(basis).max(axis=(0, 2)) > 0.006, MOBILE, 1.0)
    poses = fit_poses(person.camera, model, seen, calm, poses)
    eye_mm = 1000 * float(np.linalg.norm(np.subtract(*rest[list(EYE_CORNERS)])))
    gaps = fitted_lip_gaps(head, columns)
    target = target_lip_gap(track.lip_gap) * eye_mm
    lids, share = lid_gaps(rest, basis), lid_openness(track)
    weights = np.zeros((track.frame_count, len(names)))
    for turn in range(ROUNDS):
        moved = model + np.tensordot(weights, basis, 1)
        if turn:
            poses = fit_poses(person.camera, moved, seen, trust, poses)
            poses = smooth_poses(poses, POSE_S * track.fps)
        grams, sides = _normal(person, poses, model, weights, basis, seen, trust)
        add_lip_equations(grams, sides, gaps, target)
        add_lid_equations(grams, sides, lids, share)
        steady = np.diag(_ridge_costs(names)) + _symmetry_costs(names)
        weights = solve_box_chain(
            lambda frame, grams=grams, steady=steady: grams[frame] + steady,
            sides - L1_COST,
            _smoothness_costs(names, track.fps),
            np.zeros(len(names)),
            np.ones(len(names)),
        )
        if progress:
            progress((turn + 1) / ROUNDS)
    weights = close_lips(weights, names, gaps, target)
    weights = close_lids(weights, names, lids, share)
    every = np.zeros((track.frame_count, len(head.expression_names)))
    every[:, columns] = weights
    drawn = person.camera.project(poses.apply(rest + np.tensordot(weights, basis, 1)))
    miss = np.linalg.norm(drawn - seen, axis=2) / track.eye_distance_px
    return FittedFrames(every, poses, miss)


def _normal(
    person: Person,
    poses: HeadPoses,
    model: Float64Array,
    weights: Float64Array,
    basis: Float64Array,
    seen: Float64Array,
    trust: Float64Array,
) -> tuple[Float64Array, Float64Array]:
    """Gram matrices (frame, component, component), right sides (frame, component) of the points."""
    count = len(basis)
    grams, sides = np.empty((len(seen), count, count)), np.empty((len(seen), count))
    for start in range(0, len(seen), BLOCK):
        part = slice(start, start + BLOCK)
        some = HeadPoses(poses.turns[part], poses.places[part])
        moved = model + np.tensordot(weights[part], basis, 1)
        slopes, left = point_equations(person.camera, some, moved, basis, seen[part], trust)
        across = np.swapaxes(slopes, 1, 2)
        grams[part] = across @ slopes
        left = left + (slopes @ weights[part][..., None])[..., 0]
        sides[part] = (across @ left[..., None])[..., 0]
    return grams, sides


def _observed_shapes(names: tuple[str, ...]) -> tuple[str, ...]:
    """Those of a head's shapes that a video can show."""
    return tuple(name for name in names if name not in UNOBSERVED)


def _ridge_costs(names: tuple[str, ...]) -> Float64Array:
    """(component,) cost of squared weights."""
    return RIDGE_COST * np.array([RIDGE_FACTORS.get(name, 1.0) for name in names])


def _smoothness_costs(names: tuple[str, ...], fps: float) -> Float64Array:
    """(component,) cost of squared changes between frames: per second, whatever the rate."""
    return (
        SMOOTHNESS_COST
        * fps
        / 25
        * np.array([_by_start(SMOOTHNESS_FACTORS, name, 1.0) for name in names])
    )


def _symmetry_costs(names: tuple[str, ...]) -> Float64Array:
    """(component, component) cost of left and right differing."""
    cost = np.zeros((len(names), len(names)))
    for i, name in enumerate(names):
        other, strength = name.replace("Left", "Right"), _by_start(SYMMETRY_COSTS, name, 0.0)
        if name.startswith("eyeLook"):
            strength = GAZE_SYMMETRY_COST
            other = other.replace("In", "?").replace("Out", "In").replace("?", "Out")
        if name.endswith("Left") and other in names:
            j = names.index(other)
            cost[[i, j], [i, j]] += strength
            cost[[i, j], [j, i]] -= strength
    return cost


def _by_start(table: dict[str, float], name: str, usual: float) -> float:
    return next((value for start, value in table.items() if name.startswith(start)), usual)
