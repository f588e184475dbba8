"""Where the head roughly is in a scan: by landmarks, or by trying many poses without."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from elocute.capture.registration.matching import Samples
from elocute.capture.registration.pose import Pose, laid_over, posed
from elocute.capture.registration.template import Template
from elocute.capture.scans.landmarks import Landmarks
from elocute.errors import CaptureError
from elocute.numerics.rigid_alignment import rigid_alignment

Floats = NDArray[np.float64]

TRIES, STEPS, POINTS = 4, 25, 700
TRIM = 0.85  # share of the points that count: hair and shoulders may differ
FAR_MM = 12.0
"""Mean distance of a laid-over head at which it is no head, or not these landmarks."""
FIRST_STEPS = 8


def start_pose(template: Template, samples: Samples, landmarks: Landmarks) -> Pose:
    """A pose within some millimetres and degrees.

    Raises CaptureError for a scan that is mirrored or inside out, landmarks that lie off the
    scan, and a scan in which no head is found.
    """
    vertices, places, weights = template.landmark_weights(landmarks)
    if not len(vertices) or not landmarks.enough:
        return _searched(template, samples)
    from scipy.spatial import KDTree

    off = np.median(KDTree(samples.points).query(places)[0])
    if off > FAR_MM / 1000:
        raise CaptureError(
            f"landmarks: found {1000 * off:.1f} mm off the scan; allowed: on its surface and in "
            "its unit"
        )
    model = template.vertices[vertices]
    pose = laid_over(template.head, model, places, weights)
    left = _apart_mm(posed(template.head, template.vertices, pose)[vertices], places)
    if left > FAR_MM:
        flipped = laid_over(template.head, model * [-1, 1, 1], places, weights)
        moved = template.vertices * [-1, 1, 1]
        mirrored = _apart_mm(posed(template.head, moved, flipped)[vertices], places)
        if mirrored < left / 2:
            raise CaptureError("scan: found mirrored; allowed: left on the left; negate its x")
        raise CaptureError(
            f"landmarks: found {left:.1f} mm off a face on average; allowed: iBUG's 68 in order"
        )
    return pose


def _apart_mm(first: Floats, second: Floats) -> float:
    return float(1000 * np.linalg.norm(first - second, axis=1).mean())


def _searched(template: Template, samples: Samples) -> Pose:
    """Rigid closest points from 24 directions; the upright ones are tried first."""
    some = samples.some(POINTS)
    drafts = [_followed(template, some, turn, FIRST_STEPS) for turn in _directions()]
    drafts.sort(key=lambda draft: draft[0])
    settled = [_followed(template, some, rigid, STEPS) for _, rigid in drafts[:TRIES]]
    best_mm, (rotation, shift) = min(settled, key=lambda found: found[0])
    if best_mm > FAR_MM:
        raise CaptureError(
            f"scan: found no head (the nearest is {best_mm:.1f} mm off); allowed: a head, its "
            "faces wound outwards; or give `landmarks`"
        )
    model = template.vertices
    return laid_over(template.head, model, model @ rotation.T + shift)


_Rigid = tuple[Floats, Floats]  # rotation (3, 3) and shift (3,) m


def _directions() -> list[Floats]:
    """The 24 rotations (3, 3) that map axes to axes."""
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            rotation = np.zeros((3, 3))
            rotation[range(3), order] = signs
            if np.linalg.det(rotation) > 0:
                found.append(rotation)
    return sorted(found, key=lambda rotation: -np.trace(rotation))


def _followed(
    template: Template, samples: Samples, start: Floats | _Rigid, steps: int
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
        # A point whose normal faces the other way counts as far off: fronts are no backs.
        far = np.sqrt(found.squared) + 0.03 * (facing < 0.2)
        kept = far <= np.quantile(far, TRIM)
        apart = float(1000 * far[kept].mean())
        rotation, shift = rigid_alignment(found.points[kept], samples.points[kept])
    return apart, (rotation, shift)
