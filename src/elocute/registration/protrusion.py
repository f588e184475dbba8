"""What of a surface stands out from what surrounds it, whichever way its triangles are wound."""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float64Array

NEIGHBOURHOOD_M = 0.025
"""About the size of a nose: what protrudes from so much is one."""


def protrusions(points: Float64Array, radius_m: float = NEIGHBOURHOOD_M) -> Float64Array:
    """(point, 3) m from the middle of each point's neighbourhood to the point itself."""
    from scipy.spatial import KDTree

    tree = KDTree(points)
    pairs = tree.query_pairs(radius_m, output_type="ndarray")
    total, number = points.copy(), np.ones(len(points))
    for here, there in (pairs.T, pairs.T[::-1]):
        number += np.bincount(here, minlength=len(points))
        for axis in range(3):
            total[:, axis] += np.bincount(here, points[there, axis], minlength=len(points))
    return points - total / number[:, None]
