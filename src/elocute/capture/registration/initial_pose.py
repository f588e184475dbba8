"""Roughly where the head is in a scan: from landmarks, or by trying many poses without them."""

from __future__ import annotations

import itertools

import numpy as np

from elocute.array_types import Float64Array
from elocute.capture.registration.correspondences import ScanSamples
from elocute.capture.registration.template import Template
from elocute.capture.registration.zero_pose import HeadPose, align_head, apply_pose
from elocute.capture.scans.landmarks import Landmarks
from elocute.errors import CaptureError
from elocute.numerics.rigid_alignment import rigid_alignment

TRIES, STEPS, POINTS = 4, 25, 700
TRIM = 0.85  # share of the points that count: hair and shoulders may differ
FAR_MM = 12.0
"""Mean distance of an aligned head beyond which the scan or the landmarks show no head."""
FIRST_STEPS = 8


def find_initial_pose(template: Template, samples: ScanSamples, landmarks: Landmarks) -> HeadPose:
    """A pose within some millimetres and degrees.

    Parameters
    ----------
    template
        The person's, or a general one.
    samples
        Of the scan.
    landmarks
        The scan's; without enough good ones 24 directions are tried.

    Raises
    ------
    CaptureError
        For a scan that is mirrored or inside out, landmarks off the scan, and a scan in which no
        head is found.
    """
    vertices, places, weights = template.landmark_weights(landmarks)
    if not len(vertices) or not landmarks.enough:
        return _search_pose(template, samples)
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
    return pose


def _apart_mm(first: Float64Array, second: Float64Array) -> float:
    return float(1000 * np.linalg.norm(first - second, axis=1).mean())


def _search_pose(template: Template, samples: ScanSamples) -> HeadPose:
    """Rigid closest points from 24 directions; the upright ones are tried first."""
    some = samples.subset(POINTS)
    drafts = [_rigid_icp(template, some, turn, FIRST_STEPS) for turn in _directions()]
    drafts.sort(key=lambda draft: draft[0])
    settled = [_rigid_icp(template, some, rigid, STEPS) for _, rigid in drafts[:TRIES]]
    best_mm, (rotation, shift) = min(settled, key=lambda found: found[0])
    if best_mm > FAR_MM:
        raise CaptureError(
            f"scan: found no head (the nearest is {best_mm:.1f} mm off); allowed: a head, its "
            "faces wound outwards; or give `landmarks`"
        )
    model = template.vertices
    return align_head(template.head, model, model @ rotation.T + shift)


_Rigid = tuple[Float64Array, Float64Array]  # rotation (3, 3) and shift (3,) m


def _directions() -> list[Float64Array]:
    """The 24 rotations (3, 3) that map axes to axes."""
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            rotation = np.zeros((3, 3))
            rotation[range(3), order] = signs
            if np.linalg.det(rotation) > 0:
                found.append(rotation)
    return sorted(found, key=lambda rotation: -np.trace(rotation))


def _rigid_icp(
    template: Template, samples: ScanSamples, start: Float64Array | _Rigid, steps: int
) -> tuple[float, _Rigid]:
    """Trimmed distance in mm and the rigid motion after some steps of closest points.

    The samples move into the frame of the template, whose surface so needs one tree only.
    """
    if isinstance(start, tuple):
        rotation, shift = start
    else:
        rotation = start
        shift = samples.points.mean(axis=0) - rotation @ template.vertices.mean(axis=0)
    surface = template.neutral_surface
    apart = np.inf
    for _ in range(steps):
        local = (samples.points - shift) @ rotation
        found = surface.closest(local, near=1)
        normals = template.neutral_normals[found.triangle]
        facing = np.einsum("ij,ij->i", normals, samples.normals @ rotation)
        # A point whose normal faces the other way counts as far off: a front is no back.
        far = np.sqrt(found.squared) + 0.03 * (facing < 0.2)
        kept = far <= np.quantile(far, TRIM)
        apart = float(1000 * far[kept].mean())
        rotation, shift = rigid_alignment(found.points[kept], samples.points[kept])
    return apart, (rotation, shift)
