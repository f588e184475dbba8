"""Falling hair is dark underneath: beside and behind the neck one looks into it from below."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.ndimage as ndimage

from recipes.looks.cards import Cards
from recipes.looks.scalp import Scalp, ramp

AXIS_MM = -120.0
"""Hair hangs round a line so far behind the tip of the nose."""
TURN_RAD, CELL_MM = np.radians(6.0), 6.0
"""Cells of the map of how far out hair reaches, round that line and down."""
WIDER, SOFT = 3, 1.0
"""How many cells round each its own reach goes, and how soft the map is."""
UNDER_MM, LIGHT = (9.0, 18.0), 0.20
"""So deep under what hangs outermost light begins to be lost, and is lost but for this share."""
FROM_MM, TO_MM, BEHIND_MM = (-10.0, -40.0), (-125.0, -85.0), (-106.0, -130.0)
"""Heights over the eyes between which that begins and ends, and distances behind the tip of the
nose between which it begins: on the head, hair lies on the scalp, and below and before the neck it
hangs open to the light."""


def dark_underneath(scalp: Scalp, cards: Cards) -> Cards:
    """The same cards, darker where others hang outside them."""
    across, height, behind = scalp.places(cards.points).T
    depth = behind - AXIS_MM
    far, turn = np.hypot(across, depth), np.arctan2(across, depth)
    at = np.stack([(turn + np.pi) / TURN_RAD, (height - height.min()) / CELL_MM])
    reach = _reach(at, far)
    outside = ndimage.map_coordinates(reach, at, order=1, mode="nearest")
    beside_neck = ramp(height, *FROM_MM) * ramp(height, *TO_MM) * ramp(behind, *BEHIND_MM)
    under = ramp(outside - far, *UNDER_MM) * beside_neck
    return replace(cards, shade=cards.shade * (1 - (1 - LIGHT) * under))


def _reach(at: np.ndarray, far: np.ndarray) -> np.ndarray:
    """(turn, height) how far out hair hangs there, mm; places `at` in cells."""
    cell = np.round(at).astype(int)
    reach = np.zeros(cell.max(1) + 1)
    np.maximum.at(reach, tuple(cell), far)
    count = len(reach)
    reach = np.concatenate([reach, reach, reach])  # round the neck it goes on
    reach = ndimage.maximum_filter(reach, WIDER, mode="nearest")
    return ndimage.gaussian_filter(reach, SOFT, mode="nearest")[count : 2 * count]
