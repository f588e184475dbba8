"""Where the head is in a scan: from its landmarks or, without them, whatever way it lies.

Noses stand out. Every place of the scan that protrudes from what surrounds it is tried as the tip
of the nose, with the face turned about it in steps; the face of the template, not the scan, must
find its counterpart. So shoulders do no harm, nor does it matter how much of the head was scanned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.errors import CaptureError
from elocute.head.normals import vertex_normals
from elocute.numerics.quaternions import from_axis_angle, to_matrices
from elocute.numerics.rigid_alignment import rigid_alignment
from elocute.registration.correspondences import ScanSamples
from elocute.registration.landmarks import Landmarks
from elocute.registration.scan import NEIGHBOURHOOD_M, protrusions
from elocute.registration.template import Template
from elocute.registration.zero_pose import HeadPose, align_head, apply_pose

NOSE_SAMPLES, SAMPLES = 4_000, 20_000
UPRIGHT_MIN = 0.5
"""Cosine between the normal and the way out, below which a protrusion is but the rim of a scan."""
NOSES, NOSES_APART_M = 40, 0.012
ROLLS, TILT_DEG = 12, 22.0
"""Turns about the way out of a nose, and how far that way itself is tried to either side."""
FACE_POINTS, DRAFT_POINTS = 250, 80
FAR_M = 0.02
"""Distance beyond which a point of the face has no counterpart, whatever it is."""
FACING = 0.2
"""Smallest cosine between the normals of a point of the face and of its counterpart."""
DRAFTS, DRAFT_STEPS, SETTLE_STEPS = 40, 6, 20
APART_M, APART_COSINE = 0.01, 0.97
"""Poses nearer to each other than this are the same."""


@dataclass(frozen=True, eq=False)
class _Pose:
    """A rotation (3, 3) and shift (3,) m of the template; its cost is a mean distance, m."""

    cost: float
    rotation: Float64Array
    shift: Float64Array


def head_candidates(template: Template, samples: ScanSamples, count: int) -> list[HeadPose]:
    """Poses in which the face may lie in a scan, the likeliest first.

    There are at most `count` of them, none close to another.
    """
    face, scan = _Face(template), _Target(samples.subset(SAMPLES))
    drafts = sorted(_drafts(face, scan), key=lambda pose: pose.cost)[:DRAFTS]
    drafts = [_settled(face, scan, pose, DRAFT_STEPS) for pose in drafts]
    chosen = _distinct(sorted(drafts, key=lambda pose: pose.cost), count)
    settled = [_settled(face, scan, pose, SETTLE_STEPS) for pose in chosen]
    return [
        align_head(
            template.head, template.vertices, template.vertices @ pose.rotation.T + pose.shift
        )
        for pose in sorted(settled, key=lambda pose: pose.cost)
    ]


def face_distance_mm(template: Template, vertices: Float64Array, samples: ScanSamples) -> float:
    """How far the face of a fitted template (vertex, 3) m lies from a scan, in the mean.

    Points of the face without a counterpart count as 20 mm.
    """
    face = _Face(template)
    normals = _normals(template, vertices)
    apart, _ = _Target(samples.subset(SAMPLES)).apart(
        vertices[face.vertices], normals[face.vertices]
    )
    return float(1000 * apart.mean())


def _normals(template: Template, vertices: Float64Array) -> Float64Array:
    return vertex_normals(vertices, template.triangles).astype(np.float64)


class _Face:
    """Evenly spread vertices of the template's face, and the tip of its nose."""

    def __init__(self, template: Template) -> None:
        places, normals = template.vertices, _normals(template, template.vertices)
        self.nose: Float64Array = places[template.nose_tip]
        face = template.open_face
        order = np.random.default_rng(0).permutation(len(face))[:FACE_POINTS]
        self.vertices: NDArray[np.intp] = face[np.sort(order)]
        self.points, self.normals = places[self.vertices], normals[self.vertices]
        around = face[np.linalg.norm(places[face] - self.nose, axis=1) < NEIGHBOURHOOD_M]
        out = self.nose - places[around].mean(axis=0)
        self.forward: Float64Array = out / np.linalg.norm(out)


@dataclass(frozen=True, eq=False)
class _Target:
    """The scan's samples, searched from the face."""

    samples: ScanSamples

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import KDTree

        return KDTree(self.samples.points)

    def apart(
        self, points: Float64Array, normals: Float64Array
    ) -> tuple[Float64Array, NDArray[np.intp]]:
        """Distances (point,) m from the surface, up to `FAR_M`, and the nearest sample.

        FAR_M where that lies further off, or faces another way.
        """
        far, nearest = self._tree.query(points, distance_upper_bound=FAR_M)
        nearest = np.minimum(nearest, len(self.samples.points) - 1)
        along = self.samples.normals[nearest]
        facing = np.einsum("ij,ij->i", normals, along)
        # Samples are sparse: their own distance would say more of that than of the fit.
        off = np.abs(np.einsum("ij,ij->i", points - self.samples.points[nearest], along))
        return np.where((far < FAR_M) & (facing > FACING), off, FAR_M), nearest


def _drafts(face: _Face, scan: _Target) -> list[_Pose]:
    """The face with its nose at every protrusion, tilted and turned about it."""
    few = slice(None, None, max(1, len(face.points) // DRAFT_POINTS))
    points, normals = face.points[few], face.normals[few]
    tilts = [np.array([x, y, 0.0]) for x in (-1, 0, 1) for y in (-1, 0, 1)]
    spins = [np.array([0.0, 0.0, 2 * np.pi * roll / ROLLS]) for roll in range(ROLLS)]
    level = _turn_onto(face.forward, np.array([0.0, 0.0, 1.0]))
    turns = [
        _matrix(np.radians(TILT_DEG) * tilt) @ _matrix(spin) @ level
        for tilt in tilts
        for spin in spins
    ]
    drafts = []
    for place, out in _noses(scan.samples):
        first = _turn_onto(np.array([0.0, 0.0, 1.0]), out)
        for turn in turns:
            rotation = first @ turn
            shift = place - rotation @ face.nose
            apart, _ = scan.apart(points @ rotation.T + shift, normals @ rotation.T)
            drafts.append(_Pose(float(apart.mean()), rotation, shift))
    return drafts


def _noses(samples: ScanSamples) -> list[tuple[Float64Array, Float64Array]]:
    """Places (3,) m that stand out, and unit directions, the most prominent first."""
    from scipy.spatial import KDTree

    few = samples.subset(NOSE_SAMPLES)
    away = protrusions(few.points)
    length = np.maximum(np.linalg.norm(away, axis=1), 1e-12)
    out = np.einsum("ij,ij->i", away, few.normals)
    kept: list[int] = []
    for place in np.argsort(-out):
        if out[place] < UPRIGHT_MIN * length[place]:
            continue
        gaps = np.linalg.norm(few.points[kept] - few.points[place], axis=1)
        if (gaps > NOSES_APART_M).all():
            kept.append(int(place))
        if len(kept) == NOSES:
            break
    places = few.points[kept]
    around = KDTree(samples.points).query_ball_point(places, NEIGHBOURHOOD_M)
    ways = np.array(
        [
            place - np.average(samples.points[near], axis=0, weights=samples.areas[near])
            for place, near in zip(places, around, strict=True)
        ]
    ).reshape(-1, 3)
    ways /= np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-12)
    return list(zip(places, ways, strict=True))


def _matrix(turn: Float64Array) -> Float64Array:
    return np.asarray(to_matrices(from_axis_angle(turn[None]))[0], np.float64)


def _turn_onto(start: Float64Array, goal: Float64Array) -> Float64Array:
    """(3, 3) the least rotation that turns one unit vector onto another."""
    axis = np.cross(start, goal)
    size = np.linalg.norm(axis)
    if size < 1e-9:
        axis = np.cross(start, np.eye(3)[np.abs(start).argmin()])
        size = np.linalg.norm(axis)
    angle = np.arctan2(np.linalg.norm(np.cross(start, goal)), start @ goal)
    return _matrix(np.asarray(angle * axis / size, np.float64))


def _settled(face: _Face, scan: _Target, pose: _Pose, steps: int) -> _Pose:
    """The pose after some steps of closest points, from the face to the scan."""
    rotation, shift, cost = pose.rotation, pose.shift, pose.cost
    for _ in range(steps):
        apart, nearest = scan.apart(face.points @ rotation.T + shift, face.normals @ rotation.T)
        weights = 1 - np.square(apart / FAR_M)
        cost = float(apart.mean())
        if (weights > 0).sum() < 12:
            break
        rotation, shift = rigid_alignment(face.points, scan.samples.points[nearest], weights)
    return _Pose(cost, rotation, shift)


def _distinct(poses: Sequence[_Pose], count: int) -> list[_Pose]:
    """The first so many that are not close to one before them."""
    kept: list[_Pose] = []
    for pose in poses:
        alike = any(
            np.linalg.norm(pose.shift - other.shift) < APART_M
            and (np.trace(pose.rotation.T @ other.rotation) - 1) / 2 > APART_COSINE
            for other in kept
        )
        if not alike:
            kept.append(pose)
        if len(kept) == count:
            break
    return kept


FAR_MM = 12.0
"""Mean distance of an aligned head beyond which the scan or the landmarks show no head."""
CANDIDATES = 5


def initial_poses(template: Template, samples: ScanSamples, landmarks: Landmarks) -> list[HeadPose]:
    """Poses of which one is within some millimetres and degrees, the likeliest first.

    With enough good landmarks they tell the only pose; without, the scan is searched for faces, of
    which a fit must find the right one. Raises CaptureError for a scan that is mirrored and
    landmarks off the scan.
    """
    vertices, places, weights = template.landmark_weights(landmarks)
    if not len(vertices) or not landmarks.enough:
        return head_candidates(template, samples, CANDIDATES)
    from scipy.spatial import KDTree

    off = np.median(KDTree(samples.points).query(places)[0])
    if off > FAR_MM / 1000:
        raise CaptureError(
            f"landmarks: found {1000 * off:.1f} mm off the scan; allowed: on its surface and in "
            "its unit"
        )
    model = template.vertices[vertices]
    pose = align_head(template.head, model, places, weights)
    left = _apart_mm(apply_pose(template.head, template.vertices, pose)[vertices], places)
    if left > FAR_MM:
        flipped = align_head(template.head, model * [-1, 1, 1], places, weights)
        moved = template.vertices * [-1, 1, 1]
        mirrored = _apart_mm(apply_pose(template.head, moved, flipped)[vertices], places)
        if mirrored < left / 2:
            raise CaptureError("scan: found mirrored; allowed: left on the left; negate its x")
        raise CaptureError(
            f"landmarks: found {left:.1f} mm off a face on average; allowed: iBUG's 68 in order"
        )
    return [pose]


def _apart_mm(first: Float64Array, second: Float64Array) -> float:
    return float(1000 * np.linalg.norm(first - second, axis=1).mean())
