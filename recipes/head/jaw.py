"""The jaw's weights and the displacements of its movements."""

from __future__ import annotations

from functools import reduce

import numpy as np

from recipes.head.assembly import Assembly
from recipes.head.pose import axis_rotation

OPEN_DEG = 20.0
FORWARD_M = 0.006
SIDE_DEG = 5.0


def jaw_weights(assembly: Assembly) -> np.ndarray:
    """(vertex,) share of the jaw bone and all bones below it."""
    anatomy = assembly.anatomy
    mh = anatomy.mh
    below = [weight for bone, weight in mh.bone_weights.items() if "jaw" in mh.ancestors(bone)]
    body = reduce(np.add, below)
    weights = np.zeros(assembly.count)
    weights[assembly.slices["skin"]] = anatomy.skin_stencil @ body[anatomy.skin_of_base]
    weights[assembly.slices["tongue"]] = 1.0
    for name in ("teeth_lower", "gums_lower"):
        weights[assembly.slices[name]] = 1.0
    return np.clip(weights, 0, 1)


def jaw_move(
    vertices: np.ndarray,
    weights: np.ndarray,
    joint: np.ndarray,
    open_deg: float = 0.0,
    side_deg: float = 0.0,
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> np.ndarray:
    """(vertex, 3) displacement of a weighted turn about the jaw joint, then a shift."""
    turn = axis_rotation("X", open_deg) @ axis_rotation("Y", side_deg)
    moved = (vertices - joint) @ turn.T + joint + np.array(shift)
    return weights[:, None] * (moved - vertices)
