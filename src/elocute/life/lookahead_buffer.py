"""A look-ahead buffer that events write pulses and steps into."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from elocute.array_types import Float32Array, Float64Array

AHEAD_ROWS = 600  # an event reaches no further beyond the row that it was found in


class LookaheadBuffer:
    """Rows (row, channel) that are drawn into and then taken from the front.

    Parameters
    ----------
    channels : int
        Columns.
    rows : int
        How many rows before the newest one an event may begin.
    """

    def __init__(self, channels: int, rows: int) -> None:
        self._first = 0
        self._rows = np.zeros((rows + AHEAD_ROWS, channels))
        self.level = np.zeros(channels)
        """(channel,) where each channel goes once all steps are done."""

    def pulse(self, channel: int, start: int, course: Float64Array, size: float) -> None:
        """Add a course (row,) times a size, from row `start` on; what lies before now is lost."""
        course = course[max(0, self._first - start) :]
        row = max(0, start - self._first)
        self._rows[row : row + len(course), channel] += size * course

    def step(self, channel: int, start: int, rise: Float64Array, target: float) -> None:
        """Go to a target along a rise (row,) from 0 to 1, and stay there."""
        size = target - self.level[channel]
        self.pulse(channel, start, rise, size)
        self._rows[max(0, start + len(rise) - self._first) :, channel] += size
        self.level[channel] = target

    def take(self, count: int) -> Float32Array:
        """The first rows (count, channel), which nothing can change any more."""
        taken = self._rows[:count].astype(np.float32)
        self._rows[:-count] = self._rows[count:].copy()
        self._rows[-count:] = self.level
        self._first += count
        return taken


def hill(rows: int) -> Float64Array:
    """(row,) a raised cosine: 0 at both ends, 1 in the middle."""
    return 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(1, rows + 1) / (rows + 1))


def rise(rows: int) -> Float64Array:
    """(row,) from 0 to 1 with least jerk, as limbs and heads go from rest to rest."""
    share = np.arange(1, rows + 1) / (rows + 1)
    return share**3 * (10 - 15 * share + 6 * share**2)


def joined(parts: Sequence[Float64Array]) -> Float64Array:
    """(row,) one course after another."""
    return np.concatenate(parts)
