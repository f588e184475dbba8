"""Measures the strength of expression folds from the vertices of a pose.

Skin folds where it is pushed together. Each zone of the face has pairs of vertices across its
folds; how much shorter these lie than at rest is the zone's strength, whatever moved them: weights,
a decoder's own shapes, a stored motion. Turns of the head change no length.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array, FloatArray

SETS, ZONES_OF_SET = 2, 8
"""Folds that cross each other are in different sets: an image has a channel for each."""
ZONES = SETS * ZONES_OF_SET


@dataclass(frozen=True, eq=False)
class Folds:
    """Where a mesh folds, and when.

    Parameters
    ----------
    names : tuple of str
        One per zone; those of the first set first.
    pairs : (pair, 2) int32
        Vertices on either side of a zone's folds.
    zone : (pair,) int32
        Which zone's they are.
    weight : (pair,) float32
        Share of a pair in its zone's measure; below 0 for pairs that part where skin folds.
    reach : (zone, 2) float32
        The measure (shortening, as a share of the length at rest, times weight, added up) at
        which folds begin, and at which they are whole.
    masks : (vertex, zone) uint8
        How much of a zone's folds a vertex has, 255 = whole; there may be fewer vertices than
        the head has.
    """

    names: tuple[str, ...]
    pairs: NDArray[np.int32]
    zone: NDArray[np.int32]
    weight: Float32Array
    reach: Float32Array
    masks: NDArray[np.uint8]

    def strengths(self, rest: FloatArray, points: FloatArray) -> Float32Array:
        """How strong the folds of each zone are.

        Parameters
        ----------
        rest, points : (vertex, 3)
            The head at rest and as it is posed, in the same unit.

        Returns
        -------
        (zone,) float32
            0 to 1.
        """
        one, two = self.pairs.T
        before = np.linalg.norm(rest[one] - rest[two], axis=1)
        after = np.linalg.norm(points[one] - points[two], axis=1)
        shorter = self.weight * (1 - after / np.maximum(before, 1e-9))
        shortening = np.bincount(self.zone, shorter, ZONES)
        share = np.clip((shortening - self.reach[:, 0]) / np.ptp(self.reach, axis=1), 0, 1)
        return (share * share * (3 - 2 * share)).astype(np.float32)

    def masks_at(self, vertices: NDArray[np.integer]) -> NDArray[np.uint8]:
        """(place, zone) masks of some of a head's vertices."""
        known = vertices < len(self.masks)
        return np.where(known[:, None], self.masks[np.where(known, vertices, 0)], np.uint8(0))


def folds_of_arrays(stored: Mapping[str, NDArray[Any]]) -> Folds:
    """Folds as `recipes.looks.folds` stores them."""
    return Folds(
        names=tuple(str(stored["names"]).split()),
        pairs=stored["pairs"].astype(np.int32),
        zone=stored["zone"].astype(np.int32),
        weight=stored["weight"].astype(np.float32),
        reach=stored["reach"].astype(np.float32),
        masks=stored["masks"],
    )
