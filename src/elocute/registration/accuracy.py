"""How far a registration lies from its scan, and from the truth where that is known."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.head.model import HeadModel
from elocute.head.normals import vertex_normals
from elocute.registration.landmarks import Landmarks
from elocute.registration.scan import Scan
from elocute.registration.template import Template

REACH_M = 0.02
"""Points of the scan further away than this are no part of the head."""
FACE_REACH_M = 0.01
FACING = 0.3
"""Smallest cosine between the normals of a face and a scan where that shows it."""


LIMIT_MM, LIMIT_NOISES, NOISE_MAX_MM = 0.4, 3.0, 2.0
"""A face found lies nearer to the scan than this, or than so many times the scan's noise."""


@dataclass(frozen=True)
class SurfaceError:
    """Distance in mm from scan points to the registered surface (VOCA 2019, section 6).

    median, mean, p95: of the points within 20 mm. covered: share of the scan's points within 20 mm
    of the surface. face: share of the face around the nose that has a point of the scan within 10
    mm that faces as it does. face_median: of the points nearest to the face. limit: a face further
    off than this is none; a noisy scan may lie further off. strange: mean distance of the face from
    the nearest that the model makes. A surface that is free to bend lies close to anything; but a
    wrong place looks like nobody's face.
    """

    median: float
    mean: float
    p95: float
    covered: float
    face: float = 1.0
    face_median: float = 0.0
    limit: float = LIMIT_MM
    strange: float = 0.0

    def record(self) -> dict[str, float]:
        """Values by name, rounded to 10 nm."""
        return {name: round(value, 5) for name, value in asdict(self).items()}


def scan_distances(template: Template, vertices: Float64Array, scan: Scan) -> Float64Array:
    """(point,) mm of a scan's points from the template at vertices (vertex, 3) m; beyond 20
    infinite.
    """
    return _distances_and_places(template, vertices, scan)[0]


def _distances_and_places(
    template: Template, vertices: Float64Array, scan: Scan
) -> tuple[Float64Array, NDArray[np.integer]]:
    """Distances (point,) mm, and a vertex (point,) of the triangle where the surface is nearest."""
    nearest = template.surface(vertices).closest(scan.points, REACH_M, near=3)
    return 1000 * np.sqrt(nearest.squared), template.triangles[nearest.triangle, 0]


def registration_error(
    template: Template, vertices: Float64Array, scan: Scan, offsets: Float64Array | None = None
) -> SurfaceError:
    """How far a template's shape (vertex, 3) m lies from its scan, and how far it may lie.

    offsets (vertex, 3) m are what it has beyond the model, where there is one.
    """
    distances, places = _distances_and_places(template, vertices, scan)
    of_face = np.zeros(len(vertices), bool)
    of_face[template.open_face] = True
    face = distances[of_face[places] & np.isfinite(distances)]
    strange = 0.0
    if offsets is not None:
        strange = float(1000 * np.linalg.norm(offsets[template.open_face], axis=1).mean())
    error = replace(
        surface_error(distances),
        strange=strange,
        face=face_coverage(template, vertices, scan),
        face_median=float(np.median(face)) if len(face) else 0.0,
    )
    if error.face_median <= LIMIT_MM:
        return error
    noise = min(scan_noise_mm(scan), NOISE_MAX_MM)
    return replace(error, limit=max(LIMIT_MM, LIMIT_NOISES * noise))


def scan_noise_mm(scan: Scan) -> float:
    """Standard deviation of a scan's noise along its normals, as far as neighbours differ by it.

    Second differences over the mesh, so that a surface that bends evenly has none.
    """
    from scipy.sparse import coo_matrix, diags, identity

    count = len(scan.points)
    a, b, c = scan.triangles.T
    rows, columns = np.r_[a, b, c], np.r_[b, c, a]
    links = coo_matrix((np.ones(len(rows)), (rows, columns)), (count, count)).tocsr()
    links = ((links + links.T) > 0).astype(np.float64)
    degree = np.maximum(np.asarray(links.sum(axis=1)).ravel(), 1)
    difference = identity(count, format="csr") - diags(1 / degree) @ links
    bends = np.einsum("ij,ij->i", difference @ scan.points, scan.normals)
    # What such differences make of white noise of unit size.
    twice = difference @ difference
    gain = np.sqrt(np.asarray(twice.multiply(twice).sum(axis=1)).ravel())
    kept = ~scan.boundary
    if not kept.any():
        return 0.0
    return float(1000 * 1.4826 * np.median(np.abs((difference @ bends / gain)[kept])))


def face_coverage(template: Template, vertices: Float64Array, scan: Scan) -> float:
    """Share of the face's vertices with a point of the scan near that faces as they do."""
    from scipy.spatial import KDTree

    face = template.open_face
    normals = vertex_normals(vertices, template.triangles)[face]
    apart, near = KDTree(scan.points).query(vertices[face], distance_upper_bound=FACE_REACH_M)
    seen = np.isfinite(apart)
    facing = np.einsum("ij,ij->i", normals[seen], scan.normals[np.asarray(near)[seen]])
    return float((facing > FACING).sum() / len(face))


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
