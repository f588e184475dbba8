"""Lips that touch: how far they are apart as tracked, and closing them on the head."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.capture.video.person_fit import lip_gaps
from elocute.head.model import HeadModel
from elocute.motion.mouth_measures import TRACKED_CLOSED, TRACKED_OPEN, TRACKED_RESTING
from elocute.numerics.smoothing import smoothstep

Floats = NDArray[np.float64]

COLUMN, CLOSED_COLUMN, MEAN = 1.0, 14.0, 4.0
"""What a mm of gap counts, in the detector's errors: along the lips, there where they touch, and
in the mean of their middle third."""
TOUCH_MM = 0.02


@dataclass(frozen=True, eq=False)
class GapRows:
    """What shapes do to the gap of the inner lips, in mm.

    columns  (column, component) along the lips
    middle   (component,) the mean of the middle third, which `measure_mouth` looks at
    share    (column,) of the middle's gap that a mouth has there when it opens: 1 in the middle
    """

    columns: Floats
    middle: Floats
    share: Floats

    def weighted(self, closed: bool) -> tuple[Floats, Floats]:
        """Rows (column + 1, component), and their targets per mm of gap (column + 1,)."""
        weight = CLOSED_COLUMN if closed else COLUMN
        rows = np.concatenate([weight * self.columns, MEAN * self.middle[None]])
        return rows, np.concatenate([weight * self.share, [MEAN]])


def gap_rows(head: HeadModel, columns: list[int]) -> GapRows:
    gaps = lip_gaps(head)
    third = gaps.shape[1] // 3
    middle = slice(third, gaps.shape[1] - third)
    jaw = gaps[head.expression_index("jawOpen")]
    return GapRows(gaps[columns].T, gaps[columns][:, middle].mean(axis=1), jaw / jaw[middle].mean())


def target_gap(tracked: Floats) -> Floats:
    """(frame,) the gap that the head's lips shall have, in eye distances.

    Trackers see a small gap between lips that touch; it is taken away where lips are nearly
    closed, so that closed means closed (as the importer of tracked clips has it).
    """
    ease = np.clip((tracked - TRACKED_CLOSED) / (TRACKED_OPEN - TRACKED_CLOSED), 0, 1)
    return smoothstep(ease) * np.maximum(tracked - TRACKED_RESTING, 0)


def add_gaps(grams: Floats, sides: Floats, rows: GapRows, target_mm: Floats) -> None:
    """Add how far the lips are apart to normal equations of all frames, in place.

    It counts for more than where they are.
    """
    for closed in (False, True):
        frames = np.flatnonzero((target_mm <= 0) == closed)
        weighted, share = rows.weighted(closed)
        grams[frames] += weighted.T @ weighted
        sides[frames] += target_mm[frames, None] * (share @ weighted)


def close_lips(weights: Floats, names: tuple[str, ...], rows: GapRows, target_mm: Floats) -> Floats:
    """Weights (frame, component) whose lips touch wherever the target is no gap.

    `mouthClose` is raised by what is left; where it is not enough, shapes that part the lips
    are taken back.
    """
    closed = np.flatnonzero(target_mm <= 0)
    weights = weights.copy()
    close = names.index("mouthClose")
    third = len(rows.columns) // 3
    middle = rows.columns[third : len(rows.columns) - third]
    for frame in closed:
        left = float((middle @ weights[frame]).max())
        if left <= TOUCH_MM:
            continue
        lift = -middle[:, close].mean()
        weights[frame, close] = min(1.0, weights[frame, close] + left / lift)
        left = float((middle @ weights[frame]).max())
        if left > TOUCH_MM:
            parting = np.maximum(middle.mean(axis=0), 0) * weights[frame]
            weights[frame] *= 1 - np.clip(left / max(parting.sum(), 1e-9), 0, 1) * (parting > 0)
    return weights
