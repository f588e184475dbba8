"""Places the key light's shadow map, and blurs it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float32Array
from elocute.head.model import HeadModel
from elocute.render.lights import Rig
from elocute.render.shading import box

ROOM = 1.12  # of the head's ball, for jaws that open and heads that turn
BLUR_M = 0.0048  # standard deviation of the blur
REACH = 2.2  # taps end at this many of them


@dataclass(frozen=True)
class ShadowView:
    """An orthographic view along the key.

    Parameters
    ----------
    matrix : (4, 4) float32
        Head space to -1…1; z is the depth, from -1 at the key's side.
    radius : float
        Half the side of what it sees, m.
    """

    matrix: Float32Array
    radius: float

    def taps(self, side: int) -> list[tuple[float, float]]:
        """(offset in pixels, share) of a Gauss kernel on a map of `side` pixels.

        Pairs of pixels are one tap between them, as linear filtering gives it.
        """
        sigma = BLUR_M * side / (2 * self.radius)
        count = max(1, int(np.ceil(REACH * sigma)))
        weights = np.exp(-0.5 * (np.arange(count + 2) / sigma) ** 2)
        taps = [(0.0, float(weights[0]))]
        for near in range(1, count + 1, 2):
            pair = weights[near] + weights[near + 1]
            offset = near + weights[near + 1] / pair
            taps += [(offset, float(pair)), (-offset, float(pair))]
        total = sum(weight for _, weight in taps)
        return [(float(offset), weight / total) for offset, weight in taps]


def shadow_view(head: HeadModel, rig: Rig) -> ShadowView:
    """The view of the key on a head."""
    low, high = head.template.min(axis=0), head.template.max(axis=0)
    middle = (low + high) / 2
    radius = ROOM * float(np.linalg.norm(head.template - middle, axis=1).max())
    towards, right, above = box(rig.lamps[0])
    axes = np.stack([right, above, -towards]).astype(np.float64) / radius
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, -axes @ middle
    return ShadowView(matrix.astype(np.float32), radius)
