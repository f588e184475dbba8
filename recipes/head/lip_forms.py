"""Whole lip forms by parameters: round apertures, and lips carried as a block."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from recipes.head.anatomy import CONTACT_RING, CORNERS
from recipes.head.lips import COLUMN_COUNT, RING_COUNT, Lips

LOWER_MIDDLE = sum(CORNERS) // 2
FAN = 1.6
"""How the columns of a lip turn round the corner: 1 turns them evenly, more later."""
STRETCHED = 0.8
"""Share of the bow of resting lips that round ones do not have: it would be a roof."""
ARC = 0.5
"""Exponent of a round hole's height: 0.5 is an ellipse, more a lens."""


@dataclass(frozen=True)
class Aperture:
    """The opening between the lips: an ellipse on the contact line. Millimetres, degrees."""

    half_width: float
    above: float  # upper lip over the middle of the hole
    below: float  # lower lip under it
    drop: float  # how far its middle and the corners lie under the rest line
    forward: float  # of the middle of the lips
    corner_back: float  # how far the corners lie behind the middle
    evert_deg: float = 0.0  # outward turn of the lips' profile
    fullness: float = 1.0  # how far the red lip bulges before its edges against rest
    thickness: float = 1.0  # height of the red lip against rest
    taper: float = 0.0  # how much thinner the lips are at the corners than at rest
    roundness: float = 1.0  # 0 keeps the rest outline's normals, 1 takes the ellipse's
    bow: float = 0.2  # share of the curve of the resting line that is left
    hole: float = 1.0  # share of the half width that is open; beyond it the lips touch
    pinch: float = 0.0  # how far each lip reaches over the other there
    corner_full: float = 0.0  # share of the red beside the corners that these have


def aperture_moves(lips: Lips, form: Aperture) -> np.ndarray:
    """(ring, column, 3) m: from rest to the form."""
    rest = lips.rest[lips.rings] * 1000
    even = rest - STRETCHED * 1000 * lips.bow()
    contact = rest[CONTACT_RING]
    corner_x = np.abs(contact[list(CORNERS), 0]).mean()
    line_y = contact[[0, 19], 1].mean()
    goal = np.empty_like(rest)
    for column in range(COLUMN_COUNT):
        u = contact[column, 0] / corner_x
        side = 0.0 if column in CORNERS else -1.0 if CORNERS[0] < column < CORNERS[1] else 1.0
        height = form.above if side > 0 else form.below
        angle = u * np.pi / 2
        flat_x = (1 - form.roundness) * u + form.roundness * np.sin(angle)
        parted = height * _arc(flat_x / form.hole)
        if form.hole < 1:
            beyond = np.clip((abs(flat_x) - form.hole) / (1 - form.hole), 0, 1)
            parted -= form.pinch * np.sin(np.pi * beyond)
        rest_bow = contact[column, 1] - line_y
        goal_contact = np.array(
            [
                form.half_width * flat_x,
                line_y + rest_bow * form.bow + side * parted - form.drop,
                contact[[0, 19], 2].mean() + form.forward - form.corner_back * u * u,
            ]
        )
        fanned = np.sign(u) * _from_middle(column) ** FAN * np.pi / 2
        goal[:, column] = goal_contact + _profile(even[:, column], form, fanned, side)
    _fill_corners(goal, form.corner_full)
    return (goal - rest) / 1000


def _fill_corners(goal: np.ndarray, share: float) -> None:
    """Give the red at the very corners of a form (ring, column, 3) that share of the way to what
    the columns beside them have: lips end in a notch else."""
    offset = goal - goal[CONTACT_RING]
    for corner in CORNERS:
        for away, less in ((0, 1.0), (1, 0.5), (-1, 0.5)):
            column = corner + away
            beside = (offset[:, column - 1] + offset[:, column + 1]) / 2
            fuller = share * less * (beside - offset[:, column])
            goal[:CONTACT_RING, column] += fuller[:CONTACT_RING]


def _arc(share: float) -> float:
    """Height of a round hole at a share of its half width, 1 in the middle."""
    return max(0.0, 1 - share**2) ** ARC


def _from_middle(column: int) -> float:
    """Share of the way from the middle of a column's lip to the corner, by count of columns."""
    if CORNERS[0] < column < CORNERS[1]:
        return abs(column - LOWER_MIDDLE) / (LOWER_MIDDLE - CORNERS[0])
    return min(column, COLUMN_COUNT - column) / CORNERS[0]


def _profile(profile: np.ndarray, form: Aperture, angle: float, side: float) -> np.ndarray:
    """(ring, 3) mm offsets from the contact point, laid along the ellipse's normal."""
    offset = profile - profile[CONTACT_RING]
    radial = offset[0, :2] / np.linalg.norm(offset[0, :2])
    ellipse = np.array([np.sin(angle), side * np.cos(angle) + 1e-9])
    if side == 0:
        ellipse = np.array([np.sign(angle), 0.0])
    normal = (1 - form.roundness) * radial + form.roundness * ellipse
    normal /= np.linalg.norm(normal)
    thinner = 1 - form.taper * np.sin(angle) ** 2
    along = offset[:, :2] @ radial * form.thickness
    along[:CONTACT_RING] *= thinner
    edge_to_edge = offset[0, 2] * (offset[:, :2] @ radial) / (offset[0, :2] @ radial)
    bulge = (offset[:, 2] - edge_to_edge)[:CONTACT_RING]
    depth = offset[:, 2].copy()
    depth[:CONTACT_RING] += (form.fullness - 1) * bulge
    turn = np.radians(form.evert_deg) * np.clip(np.arange(RING_COUNT) / -9 + 1.2, 0, 1)
    turned = along * np.cos(turn) + depth * np.sin(turn) * 0.5
    raised = depth * np.cos(turn) + along * np.sin(turn)
    return np.c_[turned[:, None] * normal, raised]


def carried_block(lips: Lips, from_skin: np.ndarray, drop_m: float, back_m: float) -> np.ndarray:
    """(ring, column, 3) m: lips in their rest form, lowered as one piece, out of a pose."""
    goal = lips.rest[lips.rings] + np.array([0, -drop_m, -back_m])
    return goal - from_skin[lips.rings]


def reach(lips: Lips, half_width_m: float, power: float = 1.0) -> np.ndarray:
    """(column,) 1 in the middle, 0 from `half_width_m` on."""
    x = lips.rest[lips.rings[CONTACT_RING], 0]
    return np.clip(1 - (x / half_width_m) ** 2, 0, 1) ** power
