"""Brows, lids, eyeballs, cheeks and nose."""

from __future__ import annotations

import numpy as np

from recipes.head.face import EYES_OPEN, NeutralFace
from recipes.head.pose import axis_rotation

LOOK_DEG = {"Down": 27.0, "Up": 21.0, "In": 32.0, "Out": 32.0}
SNEER_FOLD = 0.5
"""How far the fold beside the nose deepens in a sneer."""
LID_DOWN, LID_UP = 0.22, 0.40
"""How far the lids follow a look down (of a blink) and up (of wide eyes)."""


def eye_and_brow_shapes(face: NeutralFace) -> dict[str, np.ndarray]:
    shapes: dict[str, np.ndarray] = {}
    folds = face.halves(SNEER_FOLD * face.off_the_lips(face.pose_unit("NasolabialDeepener")))
    for side in ("Left", "Right"):
        low = side.lower()
        wide = face.expression(f"eye-{low}-opened-up")
        # MakeHuman moves a brow in three parts; its arch goes with the whole.
        arch = face.expression(f"eyebrows-{low}-up")
        outer = face.expression(f"eyebrows-{low}-extern-up")
        skin = {
            "browDown": 1.05 * face.expression(f"eyebrows-{low}-down") - arch - 0.35 * outer,
            "browOuterUp": outer + 1.6 * arch,
            "eyeBlink": face.expression(f"eye-{low}-closure") - EYES_OPEN * wide,
            "eyeWide": wide,
            "eyeSquint": face.pose_unit(f"{side}LowerLidUp"),
            "cheekSquint": face.pose_unit(f"{side}CheekUp"),
            "noseSneer": 1.4 * face.expression(f"nose-{low}-elevation") + folds[side],
        }
        shapes |= {name + side: face.of_skin(moved) for name, moved in skin.items()}
        for way in LOOK_DEG:
            shapes[f"eyeLook{way}{side}"] = _look(face, way, side)
        shapes[f"eyeLookDown{side}"] += LID_DOWN * shapes[f"eyeBlink{side}"]
        shapes[f"eyeLookUp{side}"] += LID_UP * shapes[f"eyeWide{side}"]
    shapes["browInnerUp"] = 1.5 * face.of_skin(
        face.expression("eyebrows-left-inner-up") + face.expression("eyebrows-right-inner-up")
    )
    shapes["cheekPuff"] = face.of_skin(face.pose_unit("CheeksPump"))
    return shapes


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
