"""Eyeballs made by formula: rings round the axis, close together where the cornea is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

AROUND = 24
PUPIL_RAD = 0.155
"""Of the vertex colours; pictures have a pupil of their own."""
RINGS_RAD = (
    0.08,
    0.130,
    0.180,
    0.24,
    0.33,
    0.385,
    0.425,
    0.455,
    0.49,
    0.62,
    0.82,
    1.05,
    1.35,
    1.75,
    2.30,
)
"""None so near to the next that rounded vertices would turn its normals: a light that the eye
mirrors would break there."""
CORNEA_MM, CORNEA_RAD = 0.55, 0.49
"""How far the cornea rises over the sphere, and where it ends."""


@dataclass(frozen=True, eq=False)
class Eyeball:
    directions: np.ndarray  # (vertex, 3) times radius = offset from the centre, for +X or -X side
    quads: np.ndarray
    angle: np.ndarray  # (vertex,) rad from the optical axis


def eyeball(radius_m: float) -> Eyeball:
    """Unit of one eye looking along +Z; the two eyes are mirror images of each other."""
    angles = np.array(RINGS_RAD)
    turn = 2 * np.pi * np.arange(AROUND) / AROUND
    bulge = 1 + CORNEA_MM / 1000 / radius_m * np.clip(1 - (angles / CORNEA_RAD) ** 2, 0, 1) ** 0.8
    rings = (
        np.stack(
            [
                np.sin(angles)[:, None] * np.cos(turn),
                np.sin(angles)[:, None] * np.sin(turn),
                np.repeat(np.cos(angles)[:, None], AROUND, 1),
            ],
            -1,
        )
        * bulge[:, None, None]
    )
    front = np.array([[0, 0, 1 + CORNEA_MM / 1000 / radius_m]])
    back = np.array([[0, 0, -1.0]])
    vertices = np.vstack([front, rings.reshape(-1, 3), back])
    quads = []
    for k in range(0, AROUND, 2):
        first, second, third = (1 + (k + i) % AROUND for i in range(3))
        quads.append([0, first, second, third])
    for row in range(len(angles) - 1):
        for k in range(AROUND):
            a, b = 1 + row * AROUND + k, 1 + row * AROUND + (k + 1) % AROUND
            quads.append([a, a + AROUND, b + AROUND, b])
    last, rear = 1 + (len(angles) - 1) * AROUND, len(vertices) - 1
    for k in range(0, AROUND, 2):
        first, second, third = (last + (k + i) % AROUND for i in range(3))
        quads.append([third, second, first, rear])
    spread = np.r_[0.0, np.repeat(angles, AROUND), np.pi]
    return Eyeball(vertices * radius_m, np.array(quads), spread)
