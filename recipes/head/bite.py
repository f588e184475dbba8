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
from recipes.head.lips import Lips

PARTS = ("tongue", "teeth_upper", "teeth_lower", "gums_upper", "gums_lower")
WALL = slice(CONTACT_RING, CONTACT_RING + 3)
"""Rings of the lips that lie against the teeth."""
FRONT_M, BACK_M = 0.012, 0.045
"""Depth behind the incisors up to which all follows the lips, and from which nothing does."""


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
        self.carry = [
            _terms(inside, count) @ np.linalg.pinv(_terms(wall, count)) for count in (2, 2, 3)
        ]

    def behind_lips(self, vertices: np.ndarray) -> np.ndarray:
        """The same vertices (vertex, 3) with the inside of the mouth behind the lips.

        An affine map. Across the face, the lips' shift is fitted by straight lines in width and
        height and by a parabola in depth.
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
