"""Measures where the opening of the lips lies, and how far light comes in through it.

Lips close round what is behind them: the smaller the opening, the less of the room teeth and
tongue see. Renderers get vertices, not weights, so it is read off the pose, as folds are: a line
from corner to corner, and how far behind it things are half as open as the lips themselves.
"""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float32Array, FloatArray
from elocute.head.model import HeadModel

ENDS = 0.70
"""Where the line ends, as a share of the way from its middle to the corners of the mouth: lips are
close together beside it."""
REACH, LEAST_REACH_M = 1.2, 0.0018
"""How much deeper light comes in by half the opening's mean height, and how deep through shut
lips."""
LIT_FROM = 0.68
"""Where between the upper and the lower lip the line lies: light comes from above, and a tooth
below the upper lip is in its shade."""
NO_LIPS_M = 1e6
"""The depth for a head that names no lips: as if they were wide open."""


def mouth_opening(head: HeadModel, points: FloatArray) -> Float32Array:
    """The opening between the lips of a pose.

    Parameters
    ----------
    head : HeadModel
        Whose lips they are.
    points : (vertex, 3)
        The head's vertices, m.

    Returns
    -------
    (3, 4) float32
        Right end, middle and left end of a line along it; in the last column how far behind that
        line things are half open, m.
    """
    if not len(head.inner_lip_upper) or not len(head.inner_corners):
        return np.full((3, 4), NO_LIPS_M, np.float32)
    upper, lower = points[head.inner_lip_upper], points[head.inner_lip_lower]
    half = len(upper) // 2
    middle = upper[half] + LIT_FROM * (lower[half] - upper[half])
    right, left = middle + ENDS * (points[head.inner_corners] - middle)
    height = np.linalg.norm(upper - lower, axis=1).mean() / 2
    line = np.stack([right, middle, left])
    reach = np.full((3, 1), LEAST_REACH_M + REACH * height)
    return np.concatenate([line, reach], axis=1).astype(np.float32)


def openness(opening: FloatArray, places: FloatArray) -> Float32Array:
    """How open (place, 1) to the room places (place, 3) m in a mouth are: 1 between the lips."""
    right, middle, left = opening[:, :3]
    away = np.minimum(_squares(places, right, middle), _squares(places, middle, left))
    return (1 / (1 + away / opening[0, 3] ** 2))[:, None].astype(np.float32)


def _squares(places: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """(place,) squared distances from the stretch between two points."""
    way = end - start
    share = np.clip((places - start) @ way / max(float(way @ way), 1e-12), 0, 1)
    off = places - start - share[:, None] * way
    return np.einsum("ij,ij->i", off, off)
