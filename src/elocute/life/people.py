"""What makes two people who say the same move differently: a few numbers made from a face."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from elocute.array_types import FloatArray


@dataclass(frozen=True)
class Person:
    """How somebody's own way of moving differs from what people do on average.

    Parameters
    ----------
    salt : float
        Added to what draws are made of, so that other things happen at other times.
    blink_rate : float
        How often lids close.
    blink_length : float
        How long they take to.
    brows : float
        How far brows go with stress.
    lean : float
        Share by which the left brow goes further than the right.
    side_mm, corner_mm : float
        How far the mouth is to the own left, and its left corner above the right one.
    """

    salt: float = 0.0
    blink_rate: float = 1.0
    blink_length: float = 1.0
    brows: float = 1.0
    lean: float = 0.0
    side_mm: float = 0.0
    corner_mm: float = 0.0

    def drawn(self, seed: int) -> Person:
        """The same person on another occasion, 0 for the first: what is left to chance differs."""
        return replace(self, salt=self.salt + 5 * (seed * SILVER % 1))


SILVER = 0.4142135623730951
AVERAGE = Person()


def person_of(identity: FloatArray) -> Person:
    """The person with a face of coefficients (identity,).

    The mean face is `AVERAGE`; zeros behind others change nothing.
    """
    place = np.arange(1, len(identity) + 1)
    # A wave of another length for each number: sums that no two faces share, and 0 of zeros.
    sums = np.cos(np.outer((1.0, 1.7, 2.3, 2.9, 3.1, 3.7, 4.3), place)) @ np.asarray(
        identity, np.float64
    )
    own = np.sin(2 * sums)
    return Person(
        salt=float(5 * sums[0]),
        blink_rate=float(2 ** (0.4 * own[1])),
        blink_length=float(1 + 0.12 * own[2]),
        brows=float(2 ** (0.2 * own[3])),
        lean=float(0.12 * own[4]),
        side_mm=float(0.4 * own[5]),
        corner_mm=float(0.5 * own[6]),
    )
