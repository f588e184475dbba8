"""Rows of least squares: what shapes do to points in a picture, in millimetres at the head."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.capture.video.camera import Camera, Poses, huber
from elocute.capture.video.face_mesh_points import FacePoints
from elocute.capture.video.face_mesh_topology import CHIN, IRIS, LIPS, RIM
from elocute.numerics.quaternions import to_matrices

Floats = NDArray[np.float64]

SIGMA_MM = 1.5
"""How far the detector's points lie from where they belong, one standard deviation."""
KIN = 2.0
"""As many neighbouring points err together: they count as one."""
CHIN_TRUST = 3.0  # jaw and lower lip open a mouth alike; the chin tells them apart
STEADY_MM = 2.0  # a spread at which a point's trust is half


def point_trust(table: FacePoints) -> Floats:
    """(478,) 0…1 how much each point counts: little where it slides over the skin."""
    trust = 1 / (1 + (table.spread_mm.astype(np.float64) / STEADY_MM) ** 2)
    trust[list(RIM)] *= 0.3
    trust[IRIS:] *= 0.5
    trust[list(LIPS)] = 1.0
    trust[list(CHIN)] = CHIN_TRUST
    return trust


def point_rows(
    camera: Camera, poses: Poses, model: Floats, basis: Floats, seen: Floats, trust: Floats
) -> tuple[Floats, Floats]:
    """Slopes (frame, 2 · point, component) and what is left (frame, 2 · point), weighted.

    model (frame, point, 3) or (point, 3) m, basis (component, point, 3) m, seen
    (frame, point, 2) pixels, trust (point,). In units of the detector's error.
    """
    stands = poses.of(model)
    scale = poses.pixel_mm(camera)[:, None]
    left = (seen - camera.project(stands)) * scale[..., None]
    weight = np.sqrt(trust * huber(np.linalg.norm(left, axis=2)) / KIN) / SIGMA_MM
    lens = camera.slopes(stands) @ to_matrices(poses.turns)[:, None]
    lens *= (scale * weight)[..., None, None]
    # (frame, point, 2, 3) @ (point, 3, component): BLAS does it point by point.
    slopes = lens @ np.transpose(basis, (1, 2, 0))
    frames, count = len(seen), len(basis)
    return slopes.reshape(frames, -1, count), (left * weight[..., None]).reshape(frames, -1)
