"""What a scan hardly shows moves with what it shows: eyes with their lids, teeth with the lips."""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float64Array
from elocute.registration.template import Template

SIDES = ("left", "right")
MOUTH_PARTS = ("teeth", "gums", "tongue")
SEATING_STEPS = 8
SEATING_PRIOR = 0.02
"""Weight, relative to a vertex of the lids, by which an eye keeps to the mean move around it."""


def carry_inner_parts(
    template: Template, before: Float64Array, after: Float64Array
) -> Float64Array:
    """Eyes and the inside of the mouth moved along with a skin that was registered.

    An eye keeps its distance from each place on its lids, as well as one ball can; teeth, gums
    and tongue keep to each other and move as the lips do.

    Parameters
    ----------
    template
        Names the regions; a head without them is left as it is.
    before, after
        (vertex, 3) m, the model, whole, and what became of it, where only the skin has moved.

    Returns
    -------
    (vertex, 3) m.
    """
    regions, result = template.head.regions, after.copy()
    moved = after - before
    for side in SIDES:
        eye = regions.get(f"eye_{side}")
        lids = [regions.get(f"lid_{part}_{side}") for part in ("upper", "lower")]
        if eye is None or any(lid is None for lid in lids):
            continue
        rim = np.concatenate([lid for lid in lids if lid is not None])
        result[eye] = before[eye] + _seated(before[eye], before[rim], after[rim])
    lips = regions.get("lips")
    parts = [regions[name] for name in MOUTH_PARTS if name in regions]
    if lips is not None and parts:
        inside = np.concatenate(parts)
        result[inside] = before[inside] + moved[lips].mean(axis=0)
    return result


def _seated(eye: Float64Array, before: Float64Array, after: Float64Array) -> Float64Array:
    """(3,) m: how far a ball moves so that its middle is as far from the lids as it was."""
    middle = (eye.max(axis=0) + eye.min(axis=0)) / 2
    apart = np.linalg.norm(before - middle, axis=1)
    carried = (after - before).mean(axis=0)
    shift = carried.copy()
    for _ in range(SEATING_STEPS):
        away = middle + shift - after
        length = np.maximum(np.linalg.norm(away, axis=1), 1e-9)
        slopes = away / length[:, None]
        prior = SEATING_PRIOR * len(after)
        gram = slopes.T @ slopes + prior * np.eye(3)
        shift = shift + np.linalg.solve(
            gram, slopes.T @ (apart - length) + prior * (carried - shift)
        )
    return shift
