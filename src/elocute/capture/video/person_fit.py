"""Fits identity, resting expression and camera to frames in which the lips rest."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.capture.video.camera_fit import (
    HeadPoses,
    PinholeCamera,
    camera_for,
    fit_poses,
    initial_poses,
    point_equations,
)
from elocute.capture.video.face_mesh_points import FacePoints, point_trust
from elocute.capture.video.face_tracking import FaceTrack
from elocute.capture.video.lip_and_lid_contact import shape_lip_gaps
from elocute.head.mediapipe_face_mesh import GAP_PAIRS, IRIS, RIM
from elocute.head.model import HeadModel
from elocute.motion.mouth_measures import TRACKED_CLOSED
from elocute.numerics.bounded_least_squares import solve_box
from elocute.numerics.quaternions import to_matrices
from elocute.one_line_repr import one_line

REST_FRAMES = 16
ROUNDS = 5
SPREAD = 3.0  # standard deviations that an identity coefficient may reach
REST_SD, REST_MAX = 0.12, 0.5  # of a resting expression's weights
SEAL = 4.0  # weight of a gap of resting lips, per mm
FOCALS = (0.9, 1.4, 2.2)  # longer picture sides
FOCAL_SD = 0.4  # of the logarithm of the focal length
REACH_M = 0.014  # standard deviation of the Gaussian by which points move their surroundings
STIFF = 0.5  # how far the field may stay behind a point that its neighbours contradict
FARTHEST_M = 0.006
# What a face may show at rest without moving: the rest belongs to identity or to motion.
RESTING = (
    "mouthSmileLeft",
    "mouthSmileRight",
    "mouthFrownLeft",
    "mouthFrownRight",
    "mouthLeft",
    "mouthRight",
    "mouthPucker",
    "mouthStretchLeft",
    "mouthStretchRight",
    "mouthRollLower",
    "mouthRollUpper",
    "mouthShrugLower",
    "mouthPressLeft",
    "mouthPressRight",
    "mouthDimpleLeft",
    "mouthDimpleRight",
    "browDownLeft",
    "browDownRight",
    "browInnerUp",
    "browOuterUpLeft",
    "browOuterUpRight",
    "cheekSquintLeft",
    "cheekSquintRight",
    "noseSneerLeft",
    "noseSneerRight",
)


@dataclass(frozen=True, eq=False)
class Person:
    """A face as a video shows it at rest.

    head: the built-in head with this face as its template: identity, resting expression and what
    these two cannot represent. identity: (77,) standard deviations. rest: (component,) weights that
    the template contains. camera: the one that took the video. bias: (478, 3) m in the head's
    frame, offset at which the detector sees each point from where the model has it, median over the
    frames at rest.
    """

    head: HeadModel
    identity: NDArray[np.float32]
    rest: NDArray[np.float32]
    camera: PinholeCamera
    bias: Float64Array

    __repr__ = one_line


def fit_person(head: HeadModel, table: FacePoints, track: FaceTrack) -> Person:
    """Estimate the face, the camera and the detector's constant offsets.

    Identity coefficients and one resting expression are fitted together in up to REST_FRAMES frames
    with closed lips (those with the smallest gap where none are closed), alternating with the
    poses. One face in front of one camera says little about the focal length, so a few are tried
    against a prior. The template follows the remaining offsets as far as they are smooth over the
    face; what is left is returned as `bias`. table: where the points lie on the built-in head.
    """
    frames = resting_frames(track)
    seen = track.points[frames]
    trust = point_trust(table)
    trust[IRIS:] = 0  # gaze varies
    best = min(
        (_fit(head, table, camera_for(track.size, focal), seen, trust) for focal in FOCALS),
        key=lambda fit: fit.cost,
    )
    rest = np.zeros(len(head.expression_names), np.float32)
    rest[_columns(head)] = best.rest
    identity = best.identity.astype(np.float32)
    own = head.with_identity(identity)
    template = own.template + np.tensordot(rest, own.expression_basis, 1)
    own = replace(own, template=template.astype(np.float32))
    closed = bool(np.median(track.lip_gap[frames]) < TRACKED_CLOSED)
    bias = _bias(best, table.on(own.template), seen[..., :2], closed)
    own, bias = _refine_template(own, table, bias, trust)
    return Person(own, identity, rest, best.camera, bias)


def resting_frames(track: FaceTrack) -> NDArray[np.intp]:
    """Frames, spread over the track, in which the lips are closed, or as closed as they get."""
    gap = np.where(track.seen, track.lip_gap, np.inf)
    closed = np.flatnonzero(gap < TRACKED_CLOSED)
    if len(closed) < 3:
        closed = np.sort(np.argsort(gap)[: max(3, track.frame_count // 10)])
        closed = closed[closed < track.frame_count]
    spread = np.linspace(0, len(closed) - 1, min(REST_FRAMES, len(closed)))
    return closed[np.unique(spread.round().astype(int))]


@dataclass(frozen=True, eq=False)
class _Fit:
    camera: PinholeCamera
    poses: HeadPoses
    identity: Float64Array
    rest: Float64Array
    cost: float


def _fit(
    head: HeadModel,
    table: FacePoints,
    camera: PinholeCamera,
    seen: Float64Array,
    trust: Float64Array,
) -> _Fit:
    columns = _columns(head)
    identities = len(head.identity_basis)
    basis = table.on(np.concatenate([head.identity_basis, head.expression_basis[columns]]))
    mean = table.on(head.template)
    prior = np.concatenate([np.ones(identities), np.full(len(columns), REST_SD**-2)])
    low = np.concatenate([np.full(identities, -SPREAD), np.zeros(len(columns))])
    high = np.concatenate([np.full(identities, SPREAD), np.full(len(columns), REST_MAX)])
    seal = np.zeros((len(head.inner_lip_upper), len(prior)))
    seal[:, identities:] = SEAL * shape_lip_gaps(head)[columns].T
    poses = initial_poses(camera, mean[:IRIS], seen[:, :IRIS])
    coefficients, cost = np.zeros(len(prior)), np.inf
    for _ in range(ROUNDS):
        model = mean + np.tensordot(coefficients, basis, 1)
        poses = fit_poses(camera, model, seen[..., :2], trust, poses)
        slopes, left = point_equations(camera, poses, model, basis, seen[..., :2], trust)
        slopes, left = slopes.reshape(-1, len(prior)), left.ravel()
        side = slopes.T @ (left + slopes @ coefficients) / len(seen)
        gram = slopes.T @ slopes / len(seen) + np.diag(prior) + seal.T @ seal
        coefficients = solve_box(gram, side, low, high)
        cost = float(left @ left) / len(seen) + float(prior @ coefficients**2)
    sides = camera.focal / (2 * max(camera.centre))
    cost += (np.log(sides / FOCALS[1]) / FOCAL_SD) ** 2
    return _Fit(camera, poses, coefficients[:identities], coefficients[identities:], cost)


def _columns(head: HeadModel) -> list[int]:
    return [head.expression_index(name) for name in RESTING]


def _bias(fit: _Fit, model: Float64Array, seen: Float64Array, closed: bool) -> Float64Array:
    """(478, 3) m in the head's frame, the residual at rest; zero where eyes look.

    Where lips never close, the gap that is left between them is an opening, not a bias.
    """
    left = (seen - fit.camera.project(fit.poses.apply(model))) * [1, -1]
    left *= fit.poses.pixel_mm(fit.camera)[:, None, None] / 1000
    flat = np.concatenate([left, np.zeros_like(left[..., :1])], axis=-1)
    bias = np.median(flat @ to_matrices(fit.poses.turns), axis=0)
    bias[IRIS:] = 0
    if not closed:
        pairs = np.array(GAP_PAIRS)
        bias[pairs] = bias[pairs].mean(axis=1, keepdims=True)
    return bias


def _refine_template(
    head: HeadModel, table: FacePoints, bias: Float64Array, trust: Float64Array
) -> tuple[HeadModel, Float64Array]:
    """Move the template by a smooth field through the offsets at the points; and what is left of
    them.

    The field depends on the place alone, so lips that touch go on touching; eyeballs move as a
    whole, and their joints with them. The rim of the face is left out, as it slides over the skin.
    bias: (478, 3) m in the head's frame. trust: (478,) weights.
    """
    places = table.on(head.template)
    used = np.setdiff1d(np.arange(IRIS), RIM)
    kernel = _kernel(places[used], places[used])
    kernel[np.diag_indices_from(kernel)] += STIFF / np.maximum(trust[used], 0.05)
    strength = np.linalg.solve(kernel, bias[used])
    field = _capped(_kernel(head.template.astype(np.float64), places[used]) @ strength)
    joints = head.joint_positions.astype(np.float64)
    for side in ("left", "right"):
        ball = head.regions[f"eye_{side}"]
        field[ball] = field[ball].mean(axis=0)
        joints[head.joint_names.index(f"eye{side.capitalize()}")] += field[ball[0]]
    moved = replace(
        head,
        template=(head.template + field).astype(np.float32),
        joint_positions=joints.astype(np.float32),
    )
    left = bias - table.on(field)
    left[IRIS:] = 0
    return moved, left


def _kernel(first: Float64Array, second: Float64Array) -> Float64Array:
    """(first, second) Gaussian of the distances between places (…, 3) m."""
    squared = ((first**2).sum(axis=1)[:, None] + (second**2).sum(axis=1)) - 2 * first @ second.T
    return np.exp(-np.maximum(squared, 0) / (2 * REACH_M**2))


def _capped(field: Float64Array) -> Float64Array:
    length = np.linalg.norm(field, axis=1, keepdims=True)
    return field * np.minimum(1, FARTHEST_M / np.maximum(length, 1e-9))
