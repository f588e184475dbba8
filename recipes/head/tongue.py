"""The tongue at rest, drawn from MakeHuman's."""

from __future__ import annotations

import numpy as np

LOWER_M, LOWER_TIP_M, BACK_M, LONGER_M = 0.0045, 0.0040, 0.003, 0.006
"""How far the root lies lower than MakeHuman's, and the tip more than that; how far the root goes
back, and how much longer the whole is."""
SUNK_M = 0.0030
"""How far the back of the tongue lies lower than MakeHuman's."""
DOME_M, GROOVE_M, GROOVE_WIDTH_M = 0.0034, 0.0019, 0.0022
"""How far its upper side is raised over its edges, and the furrow along the middle of
its front."""
NARROWER = 0.16
"""Share of its width that it loses in front, between the teeth."""
TIP_WIDTH_M, TIP_BACK_M, TIP_UP_M = 0.0065, 0.0011, 0.0006
"""So far aside of its middle the tip lies further back, and its under side higher, by these: it is
a spoon's, MakeHuman's is a board's."""


def along(points: np.ndarray) -> np.ndarray:
    """(vertex,) 0 at the root, 1 at the tip."""
    z = points[:, 2]
    return (z - z.min()) / np.ptp(z)


def resting(points: np.ndarray) -> np.ndarray:
    """(vertex, 3) m by which MakeHuman's tongue moves: lower and longer, so that its tip lies
    behind the lower teeth, narrow enough for them, round above and with a groove."""
    tip, x = along(points), points[:, 0]
    middle = np.polynomial.Polynomial.fit(tip, points[:, 1], 4)(tip)
    upper = np.clip((points[:, 1] - middle) / 0.003, 0, 1)
    edge = np.abs(x).max() * np.sqrt(np.clip(1.05 - tip**3, 0.1, 1))
    groove = GROOVE_M * np.exp(-((x / GROOVE_WIDTH_M) ** 2)) * np.clip(2 * tip - 0.9, 0, 1)
    dome = DOME_M * (1 - (x / edge) ** 2) - groove
    sunk = SUNK_M * (1 - tip) ** 0.5
    fades = np.clip((1 - tip) / 0.06, 0, 1)
    down = -LOWER_M - LOWER_TIP_M * tip - sunk + upper * fades * dome
    aside = np.minimum(np.abs(x) / TIP_WIDTH_M, 1.4) ** 2
    under = np.clip((middle - points[:, 1]) / 0.003, 0, 1)
    back = -BACK_M + LONGER_M * tip - TIP_BACK_M * aside * np.clip((tip - 0.82) / 0.14, 0, 1)
    up = TIP_UP_M * aside * under * np.clip((tip - 0.70) / 0.20, 0, 1)
    return np.stack([-NARROWER * x * tip**2, down + up, back], 1)
