"""What every picture of a head needs besides positions: normals and colours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.head.model import HeadModel

Floats = NDArray[np.float32]


def vertex_normals(points: Floats, triangles: NDArray[np.integer]) -> Floats:
    """(vertex, 3) unit normals, triangles weighted by area."""
    corners = points[triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.stack(
        [
            np.bincount(triangles.ravel(), np.repeat(faces[:, axis], 3), len(points))
            for axis in range(3)
        ],
        axis=1,
    )
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    return (sums / np.maximum(lengths, 1e-20)).astype(np.float32)


def linear_colors(head: HeadModel) -> Floats:
    """(vertex, 3) linear colours with the baked occlusion in them."""
    srgb = head.vertex_color.astype(np.float32) / 255
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return (linear * head.occlusion[:, None]).astype(np.float32)
