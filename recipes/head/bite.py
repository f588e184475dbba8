"""Teeth, gums and tongue kept behind the lips of every face.

MakeHuman's controls move lips and teeth apart from each other: some faces would bite their lips,
others hide their teeth. Here the front of the mouth's inside follows the lips' inner wall, the
back follows the skull.
"""

from __future__ import annotations

import numpy as np

from elocute.numerics.smoothing import smoothstep
from recipes.head.anatomy import CONTACT_RING
from recipes.head.assembly import Assembly
from recipes.head.lips import COLUMN_COUNT, Lips

PARTS = ("tongue", "teeth_upper", "teeth_lower", "gums_upper", "gums_lower")
WALL = slice(CONTACT_RING, CONTACT_RING + 3)
"""Rings of the lips that lie against the teeth."""
FRONT_M, BACK_M = 0.012, 0.045
"""Depth behind the incisors up to which all follows the lips, and from which nothing does."""
MIDDLE_M = 0.010
"""How far from the middle lips decide how high the incisors stand: lips of people bend, and with
their corners the teeth of some would rise out of sight."""


class Bite:
    """How the inside of the neutral mouth lies behind its lips."""

    def __init__(self, assembly: Assembly, lips: Lips, neutral: np.ndarray) -> None:
        self.places = np.concatenate([np.r_[assembly.slices[name]] for name in PARTS])
        self.neutral = neutral
        self.wall = lips.rings[WALL].ravel()
        inside, wall = neutral[self.places], neutral[self.wall]
        depth = inside[:, 2].max() - inside[:, 2]
        share = 1 - smoothstep(np.clip((depth - FRONT_M) / (BACK_M - FRONT_M), 0, 1))
        self.share = share[:, None]
        everywhere = np.ones(len(wall))
        line = (np.arange(len(wall)) < COLUMN_COUNT).astype(float)  # of the first of its rings
        middle = line * np.exp(-((wall[:, 0] / MIDDLE_M) ** 2))
        self.carry = [
            _terms(inside, count) @ _fit(_terms(wall, count), weights)
            for count, weights in ((2, everywhere), (2, middle), (3, line))
        ]

    def behind_lips(self, vertices: np.ndarray) -> np.ndarray:
        """The same vertices (vertex, 3) with the inside of the mouth behind the lips.

        An affine map. Across the face, the lips' shift is fitted by straight lines in width and
        height and by a parabola in depth; of height and depth only where they meet, of height most
        in its middle.
        """
        moved = vertices[self.wall] - self.neutral[self.wall]
        by_lips = np.stack([self.carry[axis] @ moved[:, axis] for axis in range(3)], 1)
        by_skull = vertices[self.places] - self.neutral[self.places]
        placed = vertices.copy()
        placed[self.places] += self.share * (by_lips - by_skull)
        return placed


def _terms(points: np.ndarray, count: int) -> np.ndarray:
    """(point, count) powers of the sideways place."""
    return (points[:, [0]] / 0.02) ** np.arange(count)


def _fit(terms: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(count, point) what makes the factors of a fit from values at points."""
    root = np.sqrt(weights)
    return np.linalg.pinv(terms * root[:, None]) * root
