"""Roughly where the head is in a scan: from landmarks, or wherever a face may be without them."""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float64Array
from elocute.errors import CaptureError
from elocute.registration.correspondences import ScanSamples
from elocute.registration.head_search import head_candidates
from elocute.registration.landmarks import Landmarks
from elocute.registration.template import Template
from elocute.registration.zero_pose import HeadPose, align_head, apply_pose

FAR_MM = 12.0
"""Mean distance of an aligned head beyond which the scan or the landmarks show no head."""
CANDIDATES = 5


def initial_poses(template: Template, samples: ScanSamples, landmarks: Landmarks) -> list[HeadPose]:
    """Poses of which one is within some millimetres and degrees, the likeliest first.

    Parameters
    ----------
    template
        The person's, or a general one.
    samples
        Of the scan.
    landmarks
        The scan's. With enough good ones they tell the only pose; without, the scan is searched for
        faces, of which a fit must find the right one.

    Raises
    ------
    CaptureError
        For a scan that is mirrored and landmarks off the scan.
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
