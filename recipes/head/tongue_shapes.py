"""Tongue: out of the mouth, to the ridge, between the teeth.

A shape bends the tongue's middle line onto a guide curve in the plane x = 0 and carries the
cross sections along, turned with the curve.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from recipes.head.face import NeutralFace
from recipes.head.lip_forms import reach
from recipes.head.lips import COLUMN_COUNT, RING_COUNT


@dataclass(frozen=True)
class Guide:
    """Where the middle line goes, from the root (0) to the tip (1).

    points: (share along the tongue, forward mm, up mm) from rest; thickness and width at the tip.
    """

    points: tuple[tuple[float, float, float], ...]
    thickness: float
    width: float


OUT = Guide(((0.0, 0, 0), (0.35, 4, 2), (0.6, 14, 5), (0.8, 25, 5.5), (1.0, 34, -1)), 0.55, 0.80)
TIP_UP = Guide(
    ((0.0, 0, 0), (0.4, 0.2, 1), (0.7, 1.5, 5.5), (0.88, 2.5, 10.5), (1.0, 2.8, 13.5)), 0.95, 0.85
)
DENTAL = Guide(
    ((0.0, 0, 0), (0.35, 2, 2.8), (0.65, 9, 7.8), (0.85, 13.0, 11.0), (1.0, 15.5, 12.2)), 0.28, 0.66
)


def tongue_shapes(face: NeutralFace) -> dict[str, np.ndarray]:
    return {
        "tongueOut": _bent(face, OUT) + face.of_skin(_lips_apart(face)),
        "tongueTipUp": _bent(face, TIP_UP),
        "tongueDental": _bent(face, DENTAL),
    }


def _bent(face: NeutralFace, guide: Guide) -> np.ndarray:
    from scipy.interpolate import PchipInterpolator

    where = face.assembly.slices["tongue"]
    rest = face.vertices[where] * 1000
    along = (rest[:, 2] - rest[:, 2].min()) / np.ptp(rest[:, 2])
    centre = np.polynomial.Polynomial.fit(along, rest[:, 1], 4)
    share, forward, up = np.array(guide.points).T
    z = PchipInterpolator(share, share * np.ptp(rest[:, 2]) + rest[:, 2].min() + forward)
    rise = PchipInterpolator(share, up)

    def line(t: np.ndarray) -> np.ndarray:
        return np.stack([centre(t) + rise(t), z(t)], -1)

    def slope(t: np.ndarray) -> np.ndarray:
        """Angle of the bent line against the line at rest."""
        step = 0.02
        bent = line(t + step) - line(t - step)
        straight_y = centre(t + step) - centre(t - step)
        straight_z = np.full_like(t, 2 * step * np.ptp(rest[:, 2]))
        return np.arctan2(bent[:, 0], bent[:, 1]) - np.arctan2(straight_y, straight_z)

    inner = np.clip(along, 0.02, 0.98)
    turn = slope(inner) * np.clip(along / 0.3, 0, 1)
    ease = along**2
    height = (rest[:, 1] - centre(along)) * (1 - ease * (1 - guide.thickness))
    middle = line(along)
    goal = np.stack(
        [
            rest[:, 0] * (1 - ease * (1 - guide.width)),
            middle[:, 0] + height * np.cos(turn),
            middle[:, 1] - height * np.sin(turn),
        ],
        1,
    )
    moved = np.zeros((face.assembly.count, 3))
    moved[where] = (goal - rest) / 1000
    return moved


def _lips_apart(face: NeutralFace) -> np.ndarray:
    """Room for the tongue: the lips part around it."""
    lips = face.lips
    moves = np.zeros((RING_COUNT, COLUMN_COUNT, 3))
    opening = reach(lips, 0.021, 0.8)
    lower, upper = np.arange(13, 26), np.r_[0:12, 27:38]
    follow = np.linspace(0.75, 1.0, RING_COUNT)[:, None, None]
    moves[:, lower] = follow * np.array([0, -0.0065, 0.0005]) * opening[lower][:, None]
    moves[:, upper] = follow * np.array([0, 0.0022, 0.0003]) * opening[upper][:, None]
    return lips.field(moves)
