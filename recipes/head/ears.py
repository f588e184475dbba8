"""Ears: MakeHuman's are slabs that stand straight out; these are tilted, rolled and hollowed.

A constant move of the neutral face, and so of every face, of the auricles and the skin round them.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from elocute.numerics.smoothing import smoothstep
from recipes.head.anatomy import Anatomy
from recipes.head.topology import adjacency, mirrored

WINGS, TALLER, WIDER = 0.20, 0.30, 0.18
"""Shares of MakeHuman's targets: rims off the skull, height, depth from front to back."""
SHARPER, DETAIL_STEPS, GRAIN_STEPS = 0.60, 24, 2
"""How much deeper folds are than MakeHuman's; the walks between which lies what a fold is."""
LOBE_IN_M, LOBE_FROM, LOBE_SMOOTHINGS = 0.0050, 0.60, 8
"""The lobe lies on the jaw: how far in its end goes, below which share of the ear's height it
begins to, and how often it is smoothed."""


class Ears:
    """Where the ears are, and how they are sculpted.

    Parameters
    ----------
    anatomy : Anatomy
        Of the head.
    skin : (vertex, 3) ndarray
        The neutral skin, m.
    """

    def __init__(self, anatomy: Anatomy, skin: np.ndarray) -> None:
        self.anatomy, self.skin = anatomy, skin
        wing = np.linalg.norm(self._target("wing-incr"), axis=1)
        self.auricle = smoothstep(np.clip(wing / (0.30 * wing.max()), 0, 1))
        """(vertex,) 1 on the auricles, 0 on the skull, smooth between."""
        links = adjacency(anatomy.skin_quads, anatomy.skin_count)
        self._walk = sp.diags(1 / np.asarray(links.sum(1)).ravel()) @ links
        height = skin[self.auricle > 0.5, 1]
        self.down = np.clip((height.max() - skin[:, 1]) / np.ptp(height), 0, 1)
        """(vertex,) 0 at the height of the ears' tops, 1 at that of their lobes' ends."""

    def sculpted(self) -> np.ndarray:
        """(vertex, 3) m: the move."""
        share = self.auricle[:, None]
        moved = WINGS * self._target("wing-incr") + TALLER * self._target("scale-vert-incr")
        moved += WIDER * self._target("scale-depth-incr")
        now = self.skin + moved
        fold = self._smoothed(now, GRAIN_STEPS) - self._smoothed(now, DETAIL_STEPS)
        moved += SHARPER * share * fold
        lobe = smoothstep(np.clip((self.down - LOBE_FROM) / (1 - LOBE_FROM), 0, 1))
        moved[:, 0] -= np.sign(self.skin[:, 0]) * LOBE_IN_M * lobe * self.auricle
        now = self.skin + moved
        round_ = self._smoothed(now, LOBE_SMOOTHINGS, lobe[:, None] * share)
        return round_ - self.skin

    def _target(self, name: str) -> np.ndarray:
        """(vertex, 3) m: one of MakeHuman's targets on both ears."""
        mh = self.anatomy.mh
        left = self.anatomy.skin(mh.target(f"ears/l-ear-{name}"))
        return left + mirrored(left, self.anatomy.skin_mirror)

    def _smoothed(self, points: np.ndarray, steps: int, share: np.ndarray | float = 1.0):
        for _ in range(steps):
            points = points + 0.5 * share * (self._walk @ points - points)
        return points
