"""Every frame: where the head is, and which shapes it makes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.capture.video.camera import Poses, first_poses, fit_poses, steadied
from elocute.capture.video.face_mesh_points import FacePoints
from elocute.capture.video.face_mesh_topology import EYE_CORNERS, IRIS, LIPS
from elocute.capture.video.face_tracking import FaceTrack
from elocute.capture.video.fitted_shapes import SPARSE, fitted_names, pulls, steadiness, ties
from elocute.capture.video.lid_contact import add_lids, lid_rows, openness, shut_lids
from elocute.capture.video.lip_contact import add_gaps, close_lips, gap_rows, target_gap
from elocute.capture.video.person_fit import Person
from elocute.capture.video.point_equations import point_rows, point_trust
from elocute.numerics.bounded_least_squares import solve_box_chain

Floats = NDArray[np.float64]

ROUNDS = 2  # pose and shapes by turns
BLOCK = 64  # frames whose slopes are held at once
POSE_S = 0.03  # standard deviation of the blur that steadies the head
MOBILE = 0.05  # trust in lips and jaw while the head is first placed


@dataclass(frozen=True, eq=False)
class Fitted:
    """What a video shows.

    weights  (frame, component) of the head's shapes, 0…1
    poses    the head before the camera
    miss     (frame, 478) how far the model's points fall from those seen, in eye distances
    """

    weights: Floats
    poses: Poses
    miss: Floats

    @property
    def lip_miss(self) -> Floats:
        """(frame,) mean over the points of the lips."""
        return self.miss[:, list(LIPS)].mean(axis=1)


def fit_frames(
    person: Person,
    table: FacePoints,
    track: FaceTrack,
    progress: Callable[[float], None] | None = None,
) -> Fitted:
    """Pose, and weights by sparse non-negative least squares, steady over time.

    What the detector sees beside the model at rest (`person.bias`) is taken away first, so a face
    at rest has weights near zero. Lips tracked as closed are closed on the head.
    """
    head = person.head
    names = fitted_names(head.expression_names)
    columns = [head.expression_index(name) for name in names]
    basis, rest = table.on(head.expression_basis[columns]), table.on(head.template)
    seen, trust = track.points[..., :2], point_trust(table)
    model = rest + person.bias
    poses = first_poses(person.camera, rest[:IRIS], track.points[:, :IRIS])
    calm = trust * np.where(np.abs(basis).max(axis=(0, 2)) > 0.006, MOBILE, 1.0)
    poses = fit_poses(person.camera, model, seen, calm, poses)
    eye_mm = 1000 * float(np.linalg.norm(np.subtract(*rest[list(EYE_CORNERS)])))
    gaps = gap_rows(head, columns)
    target = target_gap(track.lip_gap) * eye_mm
    lids, share = lid_rows(rest, basis), openness(track)
    weights = np.zeros((track.frame_count, len(names)))
    for turn in range(ROUNDS):
        moved = model + np.tensordot(weights, basis, 1)
        if turn:
            poses = fit_poses(person.camera, moved, seen, trust, poses)
            poses = steadied(poses, POSE_S * track.fps)
        grams, sides = _normal(person, poses, model, weights, basis, seen, trust)
        add_gaps(grams, sides, gaps, target)
        add_lids(grams, sides, lids, share)
        steady = np.diag(pulls(names)) + ties(names)
        weights = solve_box_chain(
            lambda frame, grams=grams, steady=steady: grams[frame] + steady,
            sides - SPARSE,
            steadiness(names, track.fps),
            np.zeros(len(names)),
            np.ones(len(names)),
        )
        if progress:
            progress((turn + 1) / ROUNDS)
    weights = close_lips(weights, names, gaps, target)
    weights = shut_lids(weights, names, lids, share)
    every = np.zeros((track.frame_count, len(head.expression_names)))
    every[:, columns] = weights
    drawn = person.camera.project(poses.of(rest + np.tensordot(weights, basis, 1)))
    miss = np.linalg.norm(drawn - seen, axis=2) / track.eye_distance_px
    return Fitted(every, poses, miss)


def _normal(
    person: Person,
    poses: Poses,
    model: Floats,
    weights: Floats,
    basis: Floats,
    seen: Floats,
    trust: Floats,
) -> tuple[Floats, Floats]:
    """Gram matrices (frame, component, component) and sides (frame, component) of the points."""
    count = len(basis)
    grams, sides = np.empty((len(seen), count, count)), np.empty((len(seen), count))
    for start in range(0, len(seen), BLOCK):
        part = slice(start, start + BLOCK)
        some = Poses(poses.turns[part], poses.places[part])
        moved = model + np.tensordot(weights[part], basis, 1)
        slopes, left = point_rows(person.camera, some, moved, basis, seen[part], trust)
        across = np.swapaxes(slopes, 1, 2)
        grams[part] = across @ slopes
        left = left + (slopes @ weights[part][..., None])[..., 0]
        sides[part] = (across @ left[..., None])[..., 0]
    return grams, sides
