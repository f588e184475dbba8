"""Brows, lids, eyeballs, cheeks and nose."""

from __future__ import annotations

import numpy as np

from recipes.head.face import EYES_OPEN, NeutralFace
from recipes.head.pose import axis_rotation
from recipes.head.pulls import Fold, Pull, both_sides, pulled

LOOK_DEG = {"Down": 27.0, "Up": 21.0, "In": 32.0, "Out": 32.0}
SHUT = 1.05
"""Of MakeHuman's shut eyes: lids overlap a little, so that eyes of other faces shut as well."""
WIDE = 1.7
"""Wide eyes, of MakeHuman's."""
LID_DOWN, LID_UP = 0.14, 0.24
"""How far the lids follow a look down (of a blink) and up (of wide eyes)."""
CHEEK = (
    Pull((32, -22), (-0.3, 5.6, 3.2), (13, 9)),
    Pull((52, -22), (-1.4, 4.4, 1.2), (13, 13)),
)
"""The muscle round the eye: the cheek's apple rises, the skin beside the eye bunches."""
LOWER_LID = 1.08
"""Of MakeHuman's raised lower lid in a squint."""
SQUINT = (Pull((29, -16), (0, 1.4, 0.9), (14, 6)), Pull((47, -1), (-1.5, 0, 0.4), (8, 8)))
"""What a squint does below and beside the lids."""
BROW = (Pull((50, 25), (0.6, 3.0, -1.0), (16, 13)),)
"""What a brow that rises outwards has beside MakeHuman's, which peaks and leaves its end behind."""
SNEER = (
    Pull((15.5, -41), (1.6, 3.4, 0.8), (7, 8)),
    Pull((12, -55), (0.6, 4.3, 1.2), (9, 7)),
    Pull((25, -32), (-1.5, 4.0, 2.2), (10, 10)),
    Pull((9, -9), (-0.4, 2.0, 1.2), (5, 6)),
    Pull((13, 16), (-1.5, -2.6, 0.6), (9, 7)),
    Fold(((15.5, -37), (20, -44), (25, -53)), 1.5, 1.5),
)
"""The wing of the nose and the upper lip rise, the bridge and the cheek bunch."""
BLOWN_MM, BLOWN_AT, BLOWN_HALF = 13.0, (44, -54, 0), (35, 38, 42)
"""How far air blows a cheek out; the ball's middle, as the place of a `Pull` and, third, mm before
the eyes; how far from there it ends: at the cheekbone, the corner of the mouth and the jaw."""
BLOWN_FROM, BLOWN_DOME = (14, -57, -30), 1.8
"""From where air pushes, and how softly the ball rises from its edge."""
FILLED = (
    Pull((15, -50), (0.6, 0.6, 2.6), (12, 7)),
    Pull((16, -83), (0.4, 0.0, 2.2), (13, 7)),
    Pull((10, -66), (-0.3, 0.0, 2.2), (12, 12)),
)
"""What air does above and below the lips, and how it pushes them out."""
PUFFED_M = 0.0008
"""How far lips overlap then."""
NOSE_UP = 0.4
"""Of MakeHuman's raised wing in a sneer."""


def eye_and_brow_shapes(face: NeutralFace) -> dict[str, np.ndarray]:
    shapes: dict[str, np.ndarray] = {}
    cheek, squint, sneer, brow = (
        both_sides(face, pulled(face, *parts)) for parts in (CHEEK, SQUINT, SNEER, BROW)
    )
    for side in ("Left", "Right"):
        low = side.lower()
        wide = face.expression(f"eye-{low}-opened-up")
        # MakeHuman moves a brow in three parts; its arch goes with the whole.
        arch = face.expression(f"eyebrows-{low}-up")
        outer = face.expression(f"eyebrows-{low}-extern-up")
        skin = {
            "browDown": 1.05 * face.expression(f"eyebrows-{low}-down") - arch - 0.35 * outer,
            "browOuterUp": 0.50 * outer + 0.60 * arch + brow[side],
            "eyeBlink": SHUT * (face.expression(f"eye-{low}-closure") - EYES_OPEN * wide),
            "eyeWide": WIDE * wide,
            "eyeSquint": LOWER_LID * face.pose_unit(f"{side}LowerLidUp") + squint[side],
            "cheekSquint": face.off_the_lips(
                0.34 * face.pose_unit(f"{side}LowerLidUp") + cheek[side]
            ),
            "noseSneer": face.resealed(
                NOSE_UP * face.expression(f"nose-{low}-elevation") + sneer[side]
            ),
        }
        shapes |= {name + side: face.of_skin(moved) for name, moved in skin.items()}
        for way in LOOK_DEG:
            shapes[f"eyeLook{way}{side}"] = _look(face, way, side)
        shapes[f"eyeLookDown{side}"] += LID_DOWN * shapes[f"eyeBlink{side}"]
        shapes[f"eyeLookUp{side}"] += LID_UP * shapes[f"eyeWide{side}"]
    shapes["browInnerUp"] = 1.5 * face.of_skin(
        face.expression("eyebrows-left-inner-up") + face.expression("eyebrows-right-inner-up")
    )
    shapes["cheekPuff"] = face.of_skin(face.resealed(_blown(face), PUFFED_M))
    return shapes


def _blown(face: NeutralFace) -> np.ndarray:
    """Both cheeks full of air beside the mouth, as balls; the edge of the jaw stays."""
    eye, side = face.assembly.eye_centre, np.sign(face.skin[:, [0]])
    place = (face.skin - [0, eye[1], eye[2]]) * 1000
    place[:, 0] = np.abs(place[:, 0])
    outwards = place - BLOWN_FROM
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    away = (((place - BLOWN_AT) / BLOWN_HALF) ** 2).sum(1)
    share = np.clip(1 - away, 0, 1)[:, None] ** BLOWN_DOME
    ball = BLOWN_MM / 1000 * share * outwards * np.hstack([side, np.ones((len(side), 2))])
    filled = both_sides(face, pulled(face, *FILLED))
    return ball + filled["Left"] + filled["Right"]


def _look(face: NeutralFace, way: str, side: str) -> np.ndarray:
    """The eyeball turns about its centre, the lids follow as MakeHuman's pose unit has it."""
    inwards = "Right" if side == "Left" else "Left"
    outwards = side
    unit = {
        "Down": f"{side}EyeDown",
        "Up": f"{side}EyeUp",
        "In": f"{side}Eyeturn{inwards}",
        "Out": f"{side}Eyeturn{outwards}",
    }[way]
    moved = face.of_skin(face.pose_unit(unit))
    sign = 1 if side == "Left" else -1
    turn = {
        "Down": axis_rotation("X", LOOK_DEG["Down"]),
        "Up": axis_rotation("X", -LOOK_DEG["Up"]),
        "In": axis_rotation("Y", -sign * LOOK_DEG["In"]),
        "Out": axis_rotation("Y", sign * LOOK_DEG["Out"]),
    }[way]
    where = face.assembly.slices[f"eye_{side.lower()}"]
    centre = face.assembly.eye_centre * [sign, 1, 1]
    moved[where] = (face.vertices[where] - centre) @ (turn.T - np.eye(3))
    return moved
