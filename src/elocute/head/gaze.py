"""How far the eyeLook shapes of a head turn its eyes."""

from __future__ import annotations

import numpy as np

from elocute.head.model import HeadModel
from elocute.numerics.rigid_alignment import nearest_rotation, turned_degrees

SIDES = ("Left", "Right")
DIRECTIONS = ("Up", "Down", "In", "Out")
TYPICAL_DEG = 30.0
"""How far a look shape turns the eyes of a head whose eyeballs are not known."""


def gaze_reach(head: HeadModel) -> dict[str, float]:
    """Degrees by which ARKit's eyeLook shapes of a head turn its eyes at weight one.

    They are the mean of both eyes, by "Up", "Down", "In" and "Out".
    """
    if not has_eyeballs(head):
        return dict.fromkeys(DIRECTIONS, TYPICAL_DEG)
    return {
        way: sum(shape_reach_degrees(head, f"eyeLook{way}{side}", side) for side in SIDES)
        / len(SIDES)
        for way in DIRECTIONS
    }


def has_eyeballs(head: HeadModel) -> bool:
    """Whether a head names the vertices of both eyes."""
    return all(len(head.regions.get(f"eye_{side.lower()}", ())) for side in SIDES)


def shape_reach_degrees(head: HeadModel, name: str, side: str) -> float:
    """How far a look turns the eyeball at weight one, read off the shape."""
    ball = head.regions[f"eye_{side.lower()}"]
    rest = head.template[ball]
    turned = rest + head.expression_basis[head.expression_index(name)][ball]
    rotation, _ = nearest_rotation(
        (turned - turned.mean(axis=0)).T.astype(np.float64) @ (rest - rest.mean(axis=0))
    )
    return turned_degrees(rotation)
