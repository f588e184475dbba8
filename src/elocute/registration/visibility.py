"""What of a head is seen from the front and from either side of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array

YAWS_DEG = (-50.0, -25.0, 0.0, 25.0, 50.0)
DEPTH_PIXELS = 2.0
"""How far behind the foremost a point of a slanting surface may lie in one pixel."""


def seen_from_front(
    points: Float64Array, surface: Float64Array, pixel_m: float
) -> NDArray[np.bool_]:
    """(point,) whether nothing of a surface hides a point from one of five cameras far away.

    Parameters
    ----------
    points
        (point, 3) m of a head that faces +Z.
    surface
        (sample, 3) m, closer to each other than a pixel.
    pixel_m
        Size of a pixel.
    """
    seen = np.zeros(len(points), bool)
    for yaw in np.radians(YAWS_DEG):
        view = np.array([[np.cos(yaw), 0, -np.sin(yaw)], [0, 1, 0], [np.sin(yaw), 0, np.cos(yaw)]])
        here, all_of_it = points @ view.T, surface @ view.T
        low = np.minimum(here.min(axis=0), all_of_it.min(axis=0))[:2]
        own, cells = (((p[:, :2] - low) / pixel_m).astype(np.intp) for p in (here, all_of_it))
        across, up = np.maximum(own.max(axis=0), cells.max(axis=0)) + 1
        foremost = np.full(across * up, -np.inf)
        np.maximum.at(foremost, cells @ (up, 1), all_of_it[:, 2])  # many times as fast in one row
        seen |= here[:, 2] >= foremost[own @ (up, 1)] - DEPTH_PIXELS * pixel_m
    return seen
