"""Long hair that meets the shoulders slides along them, before them or behind, and lies there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from recipes.looks.scalp import Places, ramp
from recipes.looks.surface import Skin, unit

RIDGE_MM, UNEVEN_MM = 118.0, 12.0
"""How far behind the tip of the nose hair parts to fall before the shoulders or behind them, and
how far that differs between neighbours: most goes behind, which is why it lies before their top."""
UNEVEN_PER_MM, UNLIKE_MM = 0.16, 6.0
"""How fast it differs, radians per mm to either side, and how far the sides are from alike."""
SOFT_MM = 7.0
"""So near to where it parts hair goes less fast to either side."""
MEETS_MM = (26.0, 6.0)
"""Over cloth, between these distances, hair comes to slide along it."""
FROM_MM = (-80.0, -115.0)
"""Between these heights over the eyes that begins."""
ASIDE, DOWN, HELD = 0.9, 0.6, 1.15
"""How fast it goes forward or back then, and down along the cloth, by its own way; and how far it
is kept from going outwards, down the slope of the shoulder: what is above holds it, and more than
all, as it is pushed outwards where it meets that."""
OFF_CLOTH_MM, INSIDE_MM = 4.5, 60.0
"""The lowest layer lies so far over cloth, others higher by their height on the head; what lies
deeper in the body than the second is on its other side."""
SINKS, SINKS_MM, SLOPES = 0.4, (60.0, 20.0), (0.15, 0.45)
"""By how much hair that has come so near over cloth comes down to it at a time, where that slopes
by these heights of its normal: it does not shoot past a ridge, but hangs free beside a collar."""


@dataclass(frozen=True, eq=False)
class Drape:
    """What hair lies on below the neck, whichever shirt it is."""

    body: Skin
    shift: np.ndarray
    """mm from the points of the head to Places."""

    def led(self, places: Places, ways: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(n, 3) unit directions in which hair goes there that wants to go `ways`; (n, 1) how far
        it lies on the body, 0..1, and (n, 3) the normals of that."""
        above, normal = self._over(places)
        near = ramp(above, *MEETS_MM) * ramp(places[:, 1:2], *FROM_MM)
        into = np.minimum((ways * normal).sum(1, keepdims=True), 0)
        side = np.tanh((places[:, 2:] + _parts_at(places)) / SOFT_MM)
        wanted = ASIDE * side * np.array([0, 0, 1.0]) + DOWN * np.array([0, -1.0, 0])
        flat = wanted - (wanted * normal).sum(1, keepdims=True) * normal
        slid = unit(ways - near * into * normal + near * flat)
        outwards = np.maximum(slid[:, :1] * np.sign(places[:, :1]), 0) * np.sign(places[:, :1])
        slid[:, :1] -= HELD * near * outwards
        return unit(slid), near, normal

    def out_of(self, places: Places, height_mm: np.ndarray) -> Places:
        """Places (n, 3) on or over cloth as hair of that height (n, 1) lies on it."""
        above, normal = self._over(places)
        wanted = OFF_CLOTH_MM + height_mm
        more = np.where(above > -INSIDE_MM, wanted - above, 0)
        falls = SINKS * ramp(above, *SINKS_MM) * ramp(normal[:, 1:2], *SLOPES)
        more = np.where(more > 0, more, falls * more) * (places[:, 1:2] < FROM_MM[0])
        return places + normal * more

    def _over(self, places: Places) -> tuple[np.ndarray, np.ndarray]:
        """(n, 1) mm over the body, and (n, 3) its normals."""
        foot, normal = self.body.nearest((places - self.shift) / 1000)
        return ((places - (1000 * foot + self.shift)) * normal).sum(1, keepdims=True), normal


def _parts_at(places: Places) -> np.ndarray:
    """(n, 1) mm behind the tip of the nose where hair parts there."""
    aside = UNEVEN_PER_MM * np.abs(places[:, :1] + UNLIKE_MM)
    return RIDGE_MM + UNEVEN_MM * (np.sin(aside) + np.sin(2.3 * aside)) / 2
