"""Makes the picture of an eye: a baked iris, its pupil as wide as the look has it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from elocute.head.looks import baked
from elocute.head.looks.pictures import decoded, jpeg
from elocute.numerics.image_sampling import bilinear

EDGE_RAD, IRIS_RAD, PUPIL_RAD = 1.35, 0.425, 0.139
"""Angles from the axis of the eye: edge of the picture, of the iris and of the drawn pupil."""
IRIS_DEPTH = 0.133
"""In radii of the eye: a flat disc, 1.6 mm behind the top of the cornea of an eye of 12 mm."""
DRAWN_MM = 4.2
"""How wide the drawn pupil is seen, as the pupil of a young person in a room is."""


@lru_cache(maxsize=8)
def eye_picture(name: str, pupils: float) -> bytes:
    """An encoded picture of both eyes, the angle from the axis growing from its middle.

    The name is one of `elocute.head.looks.look.EYES`; `pupils` is their diameter in mm. The iris is
    drawn together or out round them, as in life.
    """
    picture = baked.picture(f"eyes/{name}")
    if pupils == DRAWN_MM:
        return picture
    pixels = decoded(picture)
    side = len(pixels)
    y, x = (np.mgrid[0:side, 0:side] + 0.5) / side * 2 - 1
    angle = np.hypot(x, y) * EDGE_RAD
    wanted = PUPIL_RAD * pupils / DRAWN_MM
    far = 2 * EDGE_RAD  # beyond the corners of the picture
    drawn = np.interp(angle, (0, wanted, IRIS_RAD, far), (0, PUPIL_RAD, IRIS_RAD, far))
    nearer = drawn / angle
    at = (np.stack([x * nearer, y * nearer], -1).reshape(-1, 2) + 1) / 2
    moved = bilinear(pixels.astype(np.float32), at, repeat=False)
    return jpeg(np.round(moved).astype(np.uint8).reshape(pixels.shape))
