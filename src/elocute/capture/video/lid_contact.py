"""Lids: how far eyes stand open as tracked, and shutting them on the head."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.capture.video.face_mesh_topology import LIDS
from elocute.capture.video.face_tracking import FaceTrack

Floats = NDArray[np.float64]

SIDES = ("left", "right")
USUAL_PERCENTILE = 80
"""Of an eye's openness: how far it stands open usually. Blinks and looks down are rarer."""
SHUT = 0.32
"""Share of the usual openness that the detector still sees between shut lids (0.2 to 0.37 on real
and drawn faces)."""
WIDEST = 1.4
MIDDLE = slice(3, 6)  # of a lid's points: around the pupil
WEIGHT = 3.0  # what a mm counts, in the detector's errors


@dataclass(frozen=True, eq=False)
class LidRows:
    """rest_mm (side,) how far the head's lids are apart at rest, and mm (side, component) by
    which shapes part them; sides as in SIDES."""

    rest_mm: Floats
    parting: Floats


def lid_pairs(side: str) -> tuple[list[int], list[int]]:
    """The detector's points in the middle of an upper and a lower lid."""
    return list(LIDS[f"upper_{side}"][MIDDLE]), list(LIDS[f"lower_{side}"][MIDDLE])


def lid_rows(rest: Floats, basis: Floats) -> LidRows:
    """rest (478, 3) m and basis (component, 478, 3) m at the detector's points."""
    gaps, partings = [], []
    for side in SIDES:
        upper, lower = lid_pairs(side)
        gaps.append(1000 * (rest[upper, 1] - rest[lower, 1]).mean())
        partings.append(1000 * (basis[:, upper, 1] - basis[:, lower, 1]).mean(axis=1))
    return LidRows(np.array(gaps), np.array(partings))


def openness(track: FaceTrack) -> Floats:
    """(frame, side) 0 where lids are shut, 1 where they are as far apart as usual."""
    shares = []
    for side in SIDES:
        upper, lower = lid_pairs(side)
        corners = track.points[:, [LIDS[f"upper_{side}"][0], LIDS[f"upper_{side}"][-1]]]
        apart = np.linalg.norm(track.points[:, upper] - track.points[:, lower], axis=2).mean(axis=1)
        shares.append(apart / np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1))
    tracked = np.stack(shares, axis=1)
    usual = np.percentile(tracked[track.seen], USUAL_PERCENTILE, axis=0)
    return np.clip((tracked / usual - SHUT) / (1 - SHUT), 0, WIDEST)


def add_lids(grams: Floats, sides: Floats, rows: LidRows, share: Floats) -> None:
    """Add how far each eye stands open to normal equations of all frames, in place."""
    for side in range(len(SIDES)):
        row = WEIGHT * rows.parting[side]
        target = WEIGHT * rows.rest_mm[side] * (share[:, side] - 1)
        grams += np.outer(row, row)
        sides += target[:, None] * row


def shut_lids(weights: Floats, names: tuple[str, ...], rows: LidRows, share: Floats) -> Floats:
    """Weights (frame, component) whose lids meet wherever the share is zero, by the blink."""
    weights = weights.copy()
    for side, name in enumerate(("eyeBlinkLeft", "eyeBlinkRight")):
        blink, parting = names.index(name), rows.parting[side]
        shut = share[:, side] <= 0
        left = rows.rest_mm[side] + weights[shut] @ parting
        weights[shut, blink] = np.clip(weights[shut, blink] - left / parting[blink], 0, 1)
    return weights
