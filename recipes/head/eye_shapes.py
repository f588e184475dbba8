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
SNEER = (
    Pull((15.5, -41), (1.6, 3.4, 0.8), (7, 8)),
    Pull((12, -55), (0.6, 4.3, 1.2), (9, 7)),
    Pull((25, -32), (-1.5, 4.0, 2.2), (10, 10)),
    Pull((9, -9), (-0.4, 2.0, 1.2), (5, 6)),
    Pull((13, 16), (-1.5, -2.6, 0.6), (9, 7)),
    Fold(((15.5, -37), (20, -44), (25, -53)), 1.5, 1.5),
)
"""The wing of the nose and the upper lip rise, the bridge and the cheek bunch."""
BLOWN, BUCCAL_MM, BUCCAL_REACH_MM = 0.70, (37, -56), (21, 26)
"""Blown cheeks, of MakeHuman's, and where between cheekbone and jaw they are blown; see `Pull`."""
FILLED = (
    Pull((34, -58), (3.4, 0.0, 5.4), (16, 18)),
    Pull((16, -49), (0.6, 0.6, 2.8), (12, 7)),
    Pull((18, -84), (0.6, 0.0, 2.2), (12, 8)),
)
"""What air does beside the corners of the mouth, and above and below them."""
PUFFED_LIPS, PUFFED_M = 0.45, 0.0008
"""How far lips follow blown cheeks, and how far they overlap then."""
NOSE_UP = 0.4
"""Of MakeHuman's raised wing in a sneer."""


def eye_and_brow_shapes(face: NeutralFace) -> dict[str, np.ndarray]:
    shapes: dict[str, np.ndarray] = {}
    cheek, squint, sneer = (
        both_sides(face, pulled(face, *parts)) for parts in (CHEEK, SQUINT, SNEER)
    )
    for side in ("Left", "Right"):
        low = side.lower()
        wide = face.expression(f"eye-{low}-opened-up")
        # MakeHuman moves a brow in three parts; its arch goes with the whole.
        arch = face.expression(f"eyebrows-{low}-up")
        outer = face.expression(f"eyebrows-{low}-extern-up")
        skin = {
            "browDown": 1.05 * face.expression(f"eyebrows-{low}-down") - arch - 0.35 * outer,
            "browOuterUp": 0.75 * outer + 1.15 * arch,
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
    blown = _blown(face)
    beside = face.off_the_lips(blown)
    shapes["cheekPuff"] = face.of_skin(
        face.resealed(beside + PUFFED_LIPS * (blown - beside), PUFFED_M)
    )
    return shapes


def _blown(face: NeutralFace) -> np.ndarray:
    """Both cheeks full of air beside the mouth; the edge of the jaw stays."""
    eye = face.assembly.eye_centre
    place = np.stack([np.abs(face.skin[:, 0]), face.skin[:, 1] - eye[1]], 1) * 1000
    buccal = np.exp(-(((place - BUCCAL_MM) / BUCCAL_REACH_MM) ** 2).sum(1))[:, None]
    filled = both_sides(face, pulled(face, *FILLED))
    return BLOWN * buccal * face.pose_unit("CheeksPump") + filled["Left"] + filled["Right"]


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
