"""What raters see of a head in a study: each clip's motion as it is shown, before it is drawn."""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float64Array
from elocute.errors import HeadError
from elocute.evaluation.phone_mouth_scores import labiodental_gap
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from recipes.study_raters.seen_mouths import SeenMouth

UPPER_FACE = (27, 28, 29, 36, 39, 42, 45)
"""iBUG landmarks, from 0, that move with the skull: the nose's bridge and the eyes' corners."""
BLOCK_FRAMES = 60


def see(motion: Motion, start_s: float) -> SeenMouth:
    """Mouth, head and lids of a motion whose first frame is at a moment of its sound, s.

    Raises HeadError for a head without lips or landmarks.
    """
    opening = measure_mouth(motion)["opening_mm"].astype(np.float64)
    return SeenMouth(
        opening, motion.fps, start_s, _lip_teeth(motion), _turns(motion), _lids(motion)
    )


def _lip_teeth(motion: Motion) -> Float64Array | None:
    try:
        return labiodental_gap(motion)
    except HeadError:  # a head without teeth shows none
        return None


def _lids(motion: Motion) -> Float64Array | None:
    """(frame,) how far the eyes are open, 1 at rest; None where the head does not say."""
    head = motion.head
    named = [f"lid_{lid}_{side}" for side in ("left", "right") for lid in ("upper", "lower")]
    if not all(len(head.regions.get(name, ())) for name in named):
        return None
    heights = []
    for name in named:
        places = head.regions[name]
        moved = motion.weights @ head.expression_basis[:, places, 1].mean(axis=1)
        heights.append(moved + head.template[places, 1].mean())
    gaps = (heights[0] - heights[1]) + (heights[2] - heights[3])
    rest = [head.template[head.regions[name], 1].mean() for name in named]
    return gaps.astype(np.float64) / float(rest[0] - rest[1] + rest[2] - rest[3])


def _turns(motion: Motion) -> Float64Array:
    """(frame, 3) degrees by which the skull is turned."""
    places = motion.head.landmarks[list(UPPER_FACE)]
    shown = np.concatenate([block[:, places] for block in motion.blocks(BLOCK_FRAMES)])
    rest = motion.head.template[places].astype(np.float64)
    rest = rest - rest.mean(axis=0)
    shown = shown - shown.mean(axis=1, keepdims=True)
    # Kabsch: the rotation that turns rest into what is shown.
    u, _, vt = np.linalg.svd(np.einsum("fvi,vj->fij", shown.astype(np.float64), rest))
    sign = np.sign(np.linalg.det(u @ vt))
    u[:, :, -1] *= sign[:, None]
    turned = u @ vt
    axis = np.stack(
        [
            turned[:, 2, 1] - turned[:, 1, 2],
            turned[:, 0, 2] - turned[:, 2, 0],
            turned[:, 1, 0] - turned[:, 0, 1],
        ],
        axis=1,
    )
    # Heads turn by a few degrees: the sine is the angle.
    return np.degrees(np.arcsin(np.clip(axis / 2, -1, 1)))
