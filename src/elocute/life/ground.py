"""Idle motion that never stops, whatever is heard.

Heads drift, lids and brows stir, eyes wander on what they rest on, and no mouth is even. Each of
these is three waves whose lengths share no multiple, so that they never come round and never all
stand still at once.
"""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float64Array
from elocute.life.people import Person
from elocute.life.prosody import ROW_RATE

SIZES = {
    "nod": 0.28,
    "turn": 0.32,
    "tilt": 0.17,
    "look_down": 0.10,
    "look_left": 0.12,
    "brow_inner": 0.018,
    "brow_left": 0.015,
    "brow_right": 0.015,
    "lid": 0.018,
    "side": 0.65,
    "corner": 0.65,
}
"""Root mean squares: degrees, weights of shapes, and mm that a mouth is aside and uneven."""
UPWARDS = ("brow_inner", "brow_left", "brow_right", "lid")
"""What is a shape's weight, and never below 0."""
SECONDS = (9.7, 5.3, 2.6)
"""Of the waves, for a channel in the middle; others take up to a third more or less."""
SHARES = (0.65, 0.6, 0.47)  # of the waves; squares sum to one
GOLDEN, PLASTIC = 0.6180339887498949, 0.7548776662466927  # step evenly through 0…1


class Ground:
    """Rows (row, channel) that go on for ever.

    Parameters
    ----------
    channels : tuple of str
        The columns.
    person : Person
        Who moves: others are elsewhere at the same time.
    """

    def __init__(self, channels: tuple[str, ...], person: Person) -> None:
        place = np.arange(1, len(channels) + 1)
        spread = 0.75 + 0.6 * (place * PLASTIC % 1)
        self._hz = 1 / (np.outer(SECONDS, spread))
        self._phases = np.outer((1, 2, 3), place) * GOLDEN + person.salt * (1 + place * PLASTIC % 1)
        self._sizes = np.array([SIZES.get(name, 0.0) for name in channels])
        self._level = self._sizes * [2.45 if name in UPWARDS else 0.0 for name in channels]
        for name, lean in (("side", person.side_mm), ("corner", person.corner_mm)):
            self._level[channels.index(name)] = lean

    def rows(self, first: int, count: int) -> Float64Array:
        """(count, channel) from row `first` on."""
        times = np.arange(first, first + count)[:, None, None] / ROW_RATE
        waves = np.sin(2 * np.pi * (times * self._hz + self._phases))
        return self._level + self._sizes * np.sqrt(2) * np.tensordot(waves, SHARES, (1, 0))
