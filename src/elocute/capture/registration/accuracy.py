"""How far a registration lies from its scan, and from the truth where that is known."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from elocute.array_types import Float64Array
from elocute.capture.registration.template import Template
from elocute.capture.scans.landmarks import Landmarks
from elocute.capture.scans.scan import Scan
from elocute.head.model import HeadModel

REACH_M = 0.02
"""Points of the scan further away than this are no part of the head."""
FACE_REACH_M = 0.01


@dataclass(frozen=True)
class SurfaceError:
    """Distance from scan points to the registered surface (VOCA 2019, section 6).

    Attributes
    ----------
    median, mean, p95
        mm, of the points within 20 mm.
    covered
        Share of the scan's points within 20 mm of the surface.
    face
        Share of the face that has a point of the scan within 10 mm.
    """

    median: float
    mean: float
    p95: float
    covered: float
    face: float = 1.0

    def record(self) -> dict[str, float]:
        """Values by name, rounded to 10 nm."""
        return {name: round(value, 5) for name, value in asdict(self).items()}


def scan_distances(template: Template, vertices: Float64Array, scan: Scan) -> Float64Array:
    """Distance of each point of a scan from the template's surface.

    Parameters
    ----------
    vertices
        (vertex, 3) m, the template's shape in the scan's frame.

    Returns
    -------
    (point,) mm; infinite beyond 20 mm.
    """
    surface = template.surface(vertices)
    squared = surface.closest(scan.points, REACH_M, near=3).squared
    return 1000 * np.sqrt(squared)


def face_coverage(head: HeadModel, vertices: Float64Array, points: Float64Array) -> float:
    """Share of the face's vertices with a point (point, 3) m near; 1 for a head without regions."""
    from scipy.spatial import KDTree

    face = vertices[head.regions["face"]] if "face" in head.regions else vertices[:0]
    if not len(face):
        return 1.0
    apart, _ = KDTree(points).query(face, distance_upper_bound=FACE_REACH_M)
    return float(np.isfinite(apart).mean())


def surface_error(distances_mm: Float64Array) -> SurfaceError:
    """Statistics of distances (point,) mm, infinite where a point is no part of the head."""
    near = distances_mm[np.isfinite(distances_mm)]
    if not len(near):
        return SurfaceError(np.inf, np.inf, np.inf, 0.0)
    return SurfaceError(
        float(np.median(near)),
        float(near.mean()),
        float(np.percentile(near, 95)),
        len(near) / len(distances_mm),
    )


def landmark_error_mm(
    head: HeadModel, vertices: Float64Array, landmarks: Landmarks
) -> float | None:
    """Mean distance of the good landmarks without the jaw line, or None without any."""
    good = np.flatnonzero(landmarks.good)
    good = good[good >= 17]
    if not len(good) or not len(head.landmarks):
        return None
    apart = vertices[head.landmarks[good]] - landmarks.points[good]
    return float(1000 * np.linalg.norm(apart, axis=1).mean())


def correspondence_mm(
    head: HeadModel, vertices: Float64Array, truth: Float64Array
) -> dict[str, float]:
    """Mean distance of vertices (vertex, 3) m from the truth, for each named region, mm."""
    apart = 1000 * np.linalg.norm(vertices - truth, axis=1)
    return {name: float(apart[where].mean()) for name, where in head.regions.items() if len(where)}
