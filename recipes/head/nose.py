"""The nose: MakeHuman's ends in a box; this one has a ball for a tip, and wings behind a crease.

A constant move of the neutral face, and so of every face.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from elocute.head.normals import vertex_normals
from recipes.head.anatomy import Anatomy
from recipes.looks.surface import triangles

CREASE_MM = (
    (9.6, -3.2, -7.6),
    (9.4, 0.6, -6.4),
    (10.6, 3.4, -7.6),
    (13.2, 5.0, -11.0),
    (16.0, 3.8, -15.6),
    (17.6, 0.0, -18.6),
)
"""The crease round a wing: from the rim of the nostril over it down to the cheek; aside, over and
behind the tip."""
CREASE_DEEP_MM, CREASE_WIDE_MM = 1.35, 1.8
WING_MM, WING_OUT_MM, WING_WIDE_MM = (14.2, -2.2, -11.0), 1.0, 3.6
"""The middle of a wing, how far it is rounded out there, and its size."""
SIDE_MM, SIDE_IN_MM, SIDE_WIDE_MM = (7.0, 0.6, -3.0), 1.3, 3.2
"""Between tip and wing the box had an edge: without it the tip is a ball."""


def sculpted(anatomy: Anatomy, skin: np.ndarray) -> np.ndarray:
    """(vertex, 3) m by which the neutral skin (vertex, 3) m moves."""
    near = np.abs(skin[:, 0]) < 0.004
    tip = skin[np.flatnonzero(near)[skin[near, 2].argmax()]] * [0, 1, 1]
    places = 1000 * (skin - tip) * np.c_[np.sign(skin[:, 0]), np.ones((len(skin), 2))]
    steps = np.linspace(0, len(CREASE_MM) - 1, 60)
    line = np.stack(
        [np.interp(steps, range(len(CREASE_MM)), column) for column in np.array(CREASE_MM).T], 1
    )
    away, at = KDTree(line).query(places)
    ends = np.sin(np.pi * np.clip(0.12 + 0.80 * at / len(line), 0, 1))
    out = -CREASE_DEEP_MM * ends * _near(away, CREASE_WIDE_MM)
    for middle, move, wide in (
        (WING_MM, WING_OUT_MM, WING_WIDE_MM),
        (SIDE_MM, -SIDE_IN_MM, SIDE_WIDE_MM),
    ):
        out = out + move * _near(np.linalg.norm(places - middle, axis=1), wide)
    normals = vertex_normals(skin, triangles(anatomy.skin_quads))
    return normals * out[:, None] / 1000


def _near(away_mm: np.ndarray, wide_mm: float) -> np.ndarray:
    return np.exp(-((away_mm / wide_mm) ** 2))
