"""What a space of faces cannot tell of one person: the template follows the points, smoothly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from elocute.capture.video.face_mesh_points import FacePoints
from elocute.capture.video.face_mesh_topology import IRIS, RIM
from elocute.head.model import HeadModel

Floats = NDArray[np.float64]

REACH_M = 0.014  # standard deviation of the Gaussian by which points carry what is around them
STIFF = 0.5  # how far the field may stay behind a point that its neighbours contradict
FARTHEST_M = 0.006


def follow_points(
    head: HeadModel, table: FacePoints, bias: Floats, trust: Floats
) -> tuple[HeadModel, Floats]:
    """The head with its template moved by a smooth field through `bias`; what is then left.

    bias (478, 3) m in the head's frame, trust (478,). The field depends on the place alone, so
    lips that touch go on touching; eyeballs are carried as they are, and their joints with them.
    The rim of the face says nothing: it slides over the skin.
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


def _kernel(first: Floats, second: Floats) -> Floats:
    """(first, second) Gaussian of the distances between places (…, 3) m."""
    squared = ((first**2).sum(axis=1)[:, None] + (second**2).sum(axis=1)) - 2 * first @ second.T
    return np.exp(-np.maximum(squared, 0) / (2 * REACH_M**2))


def _capped(field: Floats) -> Floats:
    length = np.linalg.norm(field, axis=1, keepdims=True)
    return field * np.minimum(1, FARTHEST_M / np.maximum(length, 1e-9))
