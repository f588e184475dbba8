"""What raters see of a head in a study: each clip's motion as it is shown, before it is drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float64Array
from elocute.errors import HeadError
from elocute.evaluation.phone_mouth_scores import labiodental_gap
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from elocute.study.raters.seen_mouths import SeenMouth

UPPER_FACE = (27, 28, 29, 36, 39, 42, 45)
"""iBUG landmarks, from 0, that move with the skull: the nose's bridge and the eyes' corners."""
BLOCK_FRAMES = 60


@dataclass(frozen=True, eq=False)
class SeenFace:
    """A face as it is shown.

    Attributes
    ----------
    mouth : SeenMouth
        Its mouth, head and lids.
    manner : (number,) float64
        Where its landmarks are on average, away from rest, and how far they go from there, mm.
    """

    mouth: SeenMouth
    manner: Float64Array


def see(motion: Motion, start_s: float) -> SeenFace:
    """What is seen of a motion.

    Parameters
    ----------
    motion : Motion
        At the study's frames, on a head with lips and landmarks.
    start_s : float
        The moment of the sound at its first frame.

    Returns
    -------
    SeenFace

    Raises
    ------
    HeadError
        For a head without lips or landmarks.
    """
    opening = measure_mouth(motion)["opening_mm"].astype(np.float64)
    moves = _landmark_moves(motion)
    mouth = SeenMouth(
        opening,
        motion.fps,
        start_s,
        _lip_teeth(motion),
        _turns(motion),
        _lids(motion),
    )
    middle = moves.mean(axis=0)
    return SeenFace(mouth, np.concatenate([middle.ravel(), moves.std(axis=0).ravel()]))


def _landmark_moves(motion: Motion) -> Float64Array:
    """(frame, 68, 3) mm from rest, in zero pose."""
    head = motion.head
    basis = head.expression_basis[:, head.landmarks].reshape(len(head.expression_names), -1)
    return 1000.0 * (motion.weights @ basis).reshape(motion.frame_count, -1, 3).astype(np.float64)


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
