"""Contact of lips and of lids: how far they are apart as tracked, and closing them on the head.

Lips and lids each add rows to the least squares of all frames (`frame_fit`) and are then shut
exactly where the track shows them shut.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from elocute.array_types import Float64Array
from elocute.capture.video.face_tracking import FaceTrack
from elocute.head.mediapipe_face_mesh import LIDS
from elocute.head.model import HeadModel
from elocute.motion.mouth_measures import TRACKED_RESTING, tracked_opening_share

COLUMN, CLOSED_COLUMN, MEAN = 1.0, 14.0, 4.0
"""Weight of a mm of gap, in the detector's errors: along the lips, there where they touch, and in
the mean of their middle third."""
TOUCH_MM = 0.02

SIDES = ("left", "right")
USUAL_PERCENTILE = 80
"""Percentile of an eye's openness that counts as usual; blinks and looks down are rarer."""
SHUT, SHUT_NARROW, SHUT_NOISE = 0.32, 0.46, 0.04
"""Share of the usual openness that the detector still sees between shut lids: 0.2 to 0.37 on most
real and drawn faces, up to the second where eyes are narrow. A least of a video between the two is
taken as shut, and what lies above it by no more than the detector's noise."""
BLINK_PART_S = 0.1
"""Nobody opens the eyes and shuts them again within this time: lids seen to do so stay shut."""
WIDEST = 1.4
MIDDLE = slice(3, 6)  # of a lid's points: around the pupil
WEIGHT = 3.0  # weight of a mm, in the detector's errors


def shape_lip_gaps(head: HeadModel) -> Float64Array:
    """(component, column) mm by which shapes part the inner lips, upward positive."""
    basis = head.expression_basis[..., 1]
    upper, lower = basis[:, head.inner_lip_upper], basis[:, head.inner_lip_lower]
    return 1000 * (upper.astype(np.float64) - lower)


@dataclass(frozen=True, eq=False)
class LipGaps:
    """What the fitted shapes do to the gap of the inner lips, in mm.

    columns: (column, component) along the lips. middle: (component,) mean of the middle third,
    which `measure_mouth` looks at. share: (column,) the gap there relative to the middle's when a
    mouth opens: 1 in the middle.
    """

    columns: Float64Array
    middle: Float64Array
    share: Float64Array

    def weighted(self, closed: bool) -> tuple[Float64Array, Float64Array]:
        """Rows (column + 1, component), and their targets per mm of gap (column + 1,)."""
        weight = CLOSED_COLUMN if closed else COLUMN
        rows = np.concatenate([weight * self.columns, MEAN * self.middle[None]])
        return rows, np.concatenate([weight * self.share, [MEAN]])


def fitted_lip_gaps(head: HeadModel, columns: list[int]) -> LipGaps:
    """The lip gaps of the shapes at `columns` of the head's expression basis."""
    gaps = shape_lip_gaps(head)
    third = gaps.shape[1] // 3
    middle = slice(third, gaps.shape[1] - third)
    jaw = gaps[head.expression_index("jawOpen")]
    return LipGaps(gaps[columns].T, gaps[columns][:, middle].mean(axis=1), jaw / jaw[middle].mean())


def target_lip_gap(tracked: Float64Array) -> Float64Array:
    """(frame,) the gap that the head's lips are to have, of a tracked one; in eye distances."""
    return tracked_opening_share(tracked) * np.maximum(tracked - TRACKED_RESTING, 0)


def add_lip_equations(
    grams: Float64Array, sides: Float64Array, rows: LipGaps, target_mm: Float64Array
) -> None:
    """Add the gap of the lips to the normal equations of all frames, in place.

    It counts for more than the position of the lips. grams (frame, component, component), sides
    (frame, component), target_mm (frame,).
    """
    for closed in (False, True):
        frames = np.flatnonzero((target_mm <= 0) == closed)
        weighted, share = rows.weighted(closed)
        grams[frames] += weighted.T @ weighted
        sides[frames] += target_mm[frames, None] * (share @ weighted)


def close_lips(
    weights: Float64Array, names: tuple[str, ...], rows: LipGaps, target_mm: Float64Array
) -> Float64Array:
    """Weights (frame, component) whose lips touch in every frame without a target gap (frame,) mm.

    `mouthClose` is raised by what is left; where that is not enough, shapes that part the lips are
    reduced.
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


@dataclass(frozen=True, eq=False)
class LidGaps:
    """What the fitted shapes do to the gap of the lids, mm, sides as in SIDES.

    rest_mm: (side,) gap of the head's lids at rest. parting: (side, component) by which shapes part
    them.
    """

    rest_mm: Float64Array
    parting: Float64Array


def _lid_pairs(side: str) -> tuple[list[int], list[int]]:
    """The detector's points in the middle of an upper and a lower lid."""
    return list(LIDS[f"upper_{side}"][MIDDLE]), list(LIDS[f"lower_{side}"][MIDDLE])


def lid_gaps(rest: Float64Array, basis: Float64Array) -> LidGaps:
    """The lid gaps of a resting face (478, 3) m and a basis (component, 478, 3) m at the points."""
    gaps, partings = [], []
    for side in SIDES:
        upper, lower = _lid_pairs(side)
        gaps.append(1000 * (rest[upper, 1] - rest[lower, 1]).mean())
        partings.append(1000 * (basis[:, upper, 1] - basis[:, lower, 1]).mean(axis=1))
    return LidGaps(np.array(gaps), np.array(partings))


def lid_openness(track: FaceTrack) -> Float64Array:
    """(frame, side) 0 where lids are shut, 1 where they are as far apart as usual."""
    shares = []
    for side in SIDES:
        upper, lower = _lid_pairs(side)
        corners = track.points[:, [LIDS[f"upper_{side}"][0], LIDS[f"upper_{side}"][-1]]]
        apart = np.linalg.norm(track.points[:, upper] - track.points[:, lower], axis=2).mean(axis=1)
        shares.append(apart / np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1))
    tracked = np.stack(shares, axis=1)
    usual = np.percentile(tracked[track.seen], USUAL_PERCENTILE, axis=0)
    tracked /= usual
    least = tracked[track.seen].min(axis=0) + SHUT_NOISE
    shut = np.where(least < SHUT_NARROW, np.maximum(least, SHUT), SHUT)
    openness = np.clip((tracked - shut) / (1 - shut), 0, WIDEST)
    for side in openness.T:
        shut_frames = np.flatnonzero(side <= 0)
        for first, last in pairwise(shut_frames):
            if last - first < BLINK_PART_S * track.fps:
                side[first:last] = 0
    return openness


def add_lid_equations(
    grams: Float64Array, sides: Float64Array, rows: LidGaps, share: Float64Array
) -> None:
    """Add the gap of the lids to the normal equations of all frames, in place.

    grams (frame, component, component), sides (frame, component), share (frame, side) openness.
    """
    for side in range(len(SIDES)):
        row = WEIGHT * rows.parting[side]
        target = WEIGHT * rows.rest_mm[side] * (share[:, side] - 1)
        grams += np.outer(row, row)
        sides += target[:, None] * row


def close_lids(
    weights: Float64Array, names: tuple[str, ...], rows: LidGaps, share: Float64Array
) -> Float64Array:
    """Weights (frame, component) whose lids meet, by the blink, wherever the openness is zero."""
    weights = weights.copy()
    for side, name in enumerate(("eyeBlinkLeft", "eyeBlinkRight")):
        blink, parting = names.index(name), rows.parting[side]
        shut = share[:, side] <= 0
        left = rows.rest_mm[side] + weights[shut] @ parting
        weights[shut, blink] = np.clip(weights[shut, blink] - left / parting[blink], 0, 1)
    return weights
