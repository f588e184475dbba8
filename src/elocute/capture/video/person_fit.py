"""Whose face it is: identity, resting expression and camera, from frames in which the lips rest."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from elocute.capture.video.camera import (
    Camera,
    Poses,
    first_poses,
    fit_poses,
    usual_camera,
)
from elocute.capture.video.face_mesh_points import FacePoints
from elocute.capture.video.face_mesh_topology import GAP_PAIRS, IRIS
from elocute.capture.video.face_tracking import FaceTrack
from elocute.capture.video.point_equations import point_rows, point_trust
from elocute.capture.video.template_refinement import follow_points
from elocute.head.model import HeadModel
from elocute.motion.mouth_measures import TRACKED_CLOSED
from elocute.numerics.bounded_least_squares import solve_box
from elocute.numerics.quaternions import to_matrices
from elocute.one_line_repr import one_line

Floats = NDArray[np.float64]

REST_FRAMES = 16
ROUNDS = 5
SPREAD = 3.0  # standard deviations that an identity coefficient may reach
REST_SD, REST_MAX = 0.12, 0.5  # of a resting expression's weights
SEAL = 4.0  # what a gap of resting lips counts, per mm
FOCALS = (0.9, 1.4, 2.2)  # longer picture sides
FOCAL_SD = 0.4  # of the logarithm of the focal length
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

    head      the built-in head with this face in its template: identity, resting expression and
              what these two cannot tell
    identity  (50,) standard deviations
    rest      (component,) weights that the template contains
    camera    the one that took the video
    bias      (478, 3) m in the head's frame: where the detector sees each point beside the place
              that the model gives it, median over the frames at rest
    """

    head: HeadModel
    identity: NDArray[np.float32]
    rest: NDArray[np.float32]
    camera: Camera
    bias: Floats

    __repr__ = one_line


def fit_person(head: HeadModel, table: FacePoints, track: FaceTrack) -> Person:
    """Find the face, the camera and what the detector keeps seeing elsewhere.

    Identity coefficients and one resting expression are sought together in up to REST_FRAMES
    frames with closed lips (those with the smallest gap where none are closed), by turns with
    the poses. One face in front of one camera tells little about the focal length, so a few are
    tried against a prior. The template follows what is left over as far as it is smooth over the
    face; the rest is told as `bias`.
    """
    frames = resting_frames(track)
    seen = track.points[frames]
    trust = point_trust(table)
    trust[IRIS:] = 0  # eyes look where they like
    best = min(
        (_fit(head, table, usual_camera(track.size, focal), seen, trust) for focal in FOCALS),
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
    own, bias = follow_points(own, table, bias, trust)
    return Person(own, identity, rest, best.camera, bias)


def resting_frames(track: FaceTrack) -> NDArray[np.intp]:
    """Frames, spread over the track, in which the lips are closed, or as closed as ever."""
    gap = np.where(track.seen, track.lip_gap, np.inf)
    closed = np.flatnonzero(gap < TRACKED_CLOSED)
    if len(closed) < 3:
        closed = np.sort(np.argsort(gap)[: max(3, track.frame_count // 10)])
        closed = closed[closed < track.frame_count]
    spread = np.linspace(0, len(closed) - 1, min(REST_FRAMES, len(closed)))
    return closed[np.unique(spread.round().astype(int))]


@dataclass(frozen=True, eq=False)
class _Fit:
    camera: Camera
    poses: Poses
    identity: Floats
    rest: Floats
    cost: float


def _fit(head: HeadModel, table: FacePoints, camera: Camera, seen: Floats, trust: Floats) -> _Fit:
    columns = _columns(head)
    identities = len(head.identity_basis)
    basis = table.on(np.concatenate([head.identity_basis, head.expression_basis[columns]]))
    mean = table.on(head.template)
    prior = np.concatenate([np.ones(identities), np.full(len(columns), REST_SD**-2)])
    low = np.concatenate([np.full(identities, -SPREAD), np.zeros(len(columns))])
    high = np.concatenate([np.full(identities, SPREAD), np.full(len(columns), REST_MAX)])
    seal = np.zeros((len(head.inner_lip_upper), len(prior)))
    seal[:, identities:] = SEAL * lip_gaps(head)[columns].T
    poses = first_poses(camera, mean[:IRIS], seen[:, :IRIS])
    found, cost = np.zeros(len(prior)), np.inf
    for _ in range(ROUNDS):
        model = mean + np.tensordot(found, basis, 1)
        poses = fit_poses(camera, model, seen[..., :2], trust, poses)
        slopes, left = point_rows(camera, poses, model, basis, seen[..., :2], trust)
        slopes, left = slopes.reshape(-1, len(prior)), left.ravel()
        side = slopes.T @ (left + slopes @ found) / len(seen)
        gram = slopes.T @ slopes / len(seen) + np.diag(prior) + seal.T @ seal
        found = solve_box(gram, side, low, high)
        cost = float(left @ left) / len(seen) + float(prior @ found**2)
    sides = camera.focal / (2 * max(camera.centre))
    cost += (np.log(sides / FOCALS[1]) / FOCAL_SD) ** 2
    return _Fit(camera, poses, found[:identities], found[identities:], cost)


def lip_gaps(head: HeadModel) -> Floats:
    """(component, column) mm by which shapes part the inner lips, upward positive."""
    basis = head.expression_basis[..., 1]
    upper, lower = basis[:, head.inner_lip_upper], basis[:, head.inner_lip_lower]
    return 1000 * (upper.astype(np.float64) - lower)


def _columns(head: HeadModel) -> list[int]:
    return [head.expression_index(name) for name in RESTING]


def _bias(fit: _Fit, model: Floats, seen: Floats, closed: bool) -> Floats:
    """What is left at rest (478, 3) m, in the head's frame; where eyes look is none of it.

    Where lips never close, the gap that is left between them is no bias but an opening.
    """
    left = (seen - fit.camera.project(fit.poses.of(model))) * [1, -1]
    left *= fit.poses.pixel_mm(fit.camera)[:, None, None] / 1000
    flat = np.concatenate([left, np.zeros_like(left[..., :1])], axis=-1)
    bias = np.median(flat @ to_matrices(fit.poses.turns), axis=0)
    bias[IRIS:] = 0
    if not closed:
        pairs = np.array(GAP_PAIRS)
        bias[pairs] = bias[pairs].mean(axis=1, keepdims=True)
    return bias
