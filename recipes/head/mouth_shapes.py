"""Jaw and lips."""

from __future__ import annotations

import numpy as np

from elocute.numerics.smoothing import smoothstep
from recipes.head.anatomy import CONTACT_RING, CORNERS
from recipes.head.face import NeutralFace
from recipes.head.jaw import FORWARD_M, OPEN_DEG, SIDE_DEG
from recipes.head.lip_forms import Aperture, aperture_moves, carried_block, reach
from recipes.head.lips import COLUMN_COUNT, PAIRS, RING_COUNT

FUNNEL = Aperture(
    half_width=9.4,
    above=4.3,
    below=4.0,
    drop=1.2,
    forward=6.0,
    corner_back=4.2,
    evert_deg=14,
    thickness=0.92,
    taper=0.10,
    roundness=0.75,
)
PUCKER = Aperture(
    half_width=8.4,
    above=0.76,
    below=0.32,
    drop=2.5,
    forward=7.5,
    corner_back=4.4,
    evert_deg=8,
    thickness=0.84,
    taper=0.20,
    roundness=0.60,
    hole=0.64,
    pinch=1.0,
)
BELOW_M, BESIDE_M = 0.008, 0.016
"""Depth under the line of the lips from which what pulls the lower lip down is whole, and the
distance beside the corners from which it is nothing."""
SUCKED = {"mouthFunnel": 0.35, "mouthPucker": 0.55}
"""How far cheeks are drawn in while lips are round, of MakeHuman's sucked cheeks."""
SMILING = {
    "LeftCheekUp": 1.0,
    "RightCheekUp": 1.0,
    "LeftLowerLidUp": 0.4,
    "RightLowerLidUp": 0.4,
    "NasolabialDeepener": 1.3,
}
"""MakeHuman's pose units in a smile."""
CLOSED_DROP_M, CLOSED_BACK_M = 0.009, 0.002
"""Where the sealed lips are while the jaw is wide open."""
TUCK_RINGS, BITE_M, LABIODENTAL_LIFT_M, LABIODENTAL_JAW = 0.8, 0.00066, 0.0003, 0.04
"""How far the lower lip rolls in and covers the incisors in f, how far the upper one rises, and
the jaw's opening that this is made for."""
PRESS_RINGS, PRESS_M, PRESS_MORE_M = 2.0, 0.0006, 0.0025
"""Pressed lips: rings rolled in, overlap at the corners, and what the middle has more, so that p
closes on a neighbour's round hole."""


def mouth_shapes(face: NeutralFace) -> dict[str, np.ndarray]:
    shapes = {
        "jawOpen": face.jaw(open_deg=OPEN_DEG),
        "jawForward": face.jaw(shift=(0, 0, FORWARD_M)),
        "jawLeft": face.jaw(side_deg=SIDE_DEG),
        "jawRight": face.jaw(side_deg=-SIDE_DEG),
    }
    skin = _round_shapes(face) | _closing_shapes(face, shapes["jawOpen"][face.skin_slice])
    skin |= _sided_shapes(face)
    skin["mouthLabiodental"] = _labiodental(face)
    return shapes | {name: face.of_skin(moved) for name, moved in skin.items()}


def _round_shapes(face: NeutralFace) -> dict[str, np.ndarray]:
    lips, cheeks = face.lips, _sucked_cheeks(face)
    forms = {"mouthFunnel": FUNNEL, "mouthPucker": PUCKER}
    rounded = {
        name: lips.field(aperture_moves(lips, form), wide=True) + SUCKED[name] * cheeks
        for name, form in forms.items()
    }
    return rounded | {
        "mouthLeft": face.resealed(face.pose_unit("MouthMoveLeft")),
        "mouthRight": face.resealed(face.pose_unit("MouthMoveRight")),
    }


def _sucked_cheeks(face: NeutralFace) -> np.ndarray:
    """Cheeks drawn in, lips where they were."""
    return face.off_the_lips(face.pose_unit("CheeksSuck"))


def _smiling_cheeks(face: NeutralFace) -> np.ndarray:
    """What a smile does beside the mouth: cheeks and lower lids rise, the fold from the nose to
    the corner deepens."""
    units = {name: face.pose_unit(name) for name in SMILING}
    return face.off_the_lips(np.sum([SMILING[name] * units[name] for name in SMILING], axis=0))


def _closing_shapes(face: NeutralFace, jaw_open: np.ndarray) -> dict[str, np.ndarray]:
    lips = face.lips
    uppers = [upper for upper, _ in PAIRS]
    press = lips.roll(PRESS_RINGS, PRESS_RINGS)
    press = press + lips.seal(
        face.skin + press, PRESS_M + PRESS_MORE_M * reach(lips, 0.0165)[uppers]
    )
    return {
        "mouthClose": lips.field(
            carried_block(lips, face.skin + jaw_open, CLOSED_DROP_M, CLOSED_BACK_M), wide=True
        ),
        "mouthRollLower": face.resealed(lips.roll(0, 3.4)),
        "mouthRollUpper": face.resealed(lips.roll(3.8, 0)),
        "mouthShrugLower": face.resealed(face.pose_unit("lowerLipUp") * 0.8, 0.0006),
        "mouthShrugUpper": face.resealed(face.pose_unit("UpperLipUp") * 0.8),
        **{f"mouthPress{side}": half for side, half in face.halves(press).items()},
    }


def _sided_shapes(face: NeutralFace) -> dict[str, np.ndarray]:
    pulled = face.expression("mouth-retraction")
    smile = face.expression("mouth-corner-puller") * [1, 0.68, 1] + pulled * [0.35, 0, 0.3]
    sources = {
        "mouthSmile": face.resealed(smile) + _smiling_cheeks(face),
        "mouthFrown": face.resealed(face.expression("mouth-depression")),
        "mouthStretch": face.resealed(pulled * [1.15, 0.1, 0.75]),
        "mouthDimple": face.resealed(face.expression("mouth-compression") * [0.6, 0.3, 0.6]),
        "mouthLowerDown": _lower_half(face, face.expression("mouth-depression-retraction")),
        "mouthUpperUp": face.expression("mouth-elevation"),
    }
    return {
        name + side: half
        for name, moved in sources.items()
        for side, half in face.halves(moved).items()
    }


def _lower_half(face: NeutralFace, displacement: np.ndarray) -> np.ndarray:
    """What a displacement does to the lower lip and below; the upper lip stays."""
    lips = face.lips
    contact = face.skin[lips.rings[CONTACT_RING]]
    line = np.interp(np.abs(face.skin[:, 0]), np.abs(contact[:13, 0]), contact[:13, 1])
    below = smoothstep(np.clip((line - face.skin[:, 1]) / BELOW_M, 0, 1))
    beside = np.abs(face.skin[:, 0]) - np.abs(contact[:, 0]).max()
    near = 1 - smoothstep(np.clip(beside / BESIDE_M, 0, 1))
    kept = displacement * (below * near)[:, None]
    moves = np.zeros((RING_COUNT, COLUMN_COUNT, 3))
    lower = np.arange(CORNERS[0] + 1, CORNERS[1])
    moves[:, lower] = displacement[lips.rings[:, lower]]
    return kept + lips.field(moves - kept[lips.rings])


def _labiodental(face: NeutralFace) -> np.ndarray:
    """The lower lip rolls in until its inner side lies on the edge of the upper incisors; the
    upper lip rises and shows them. Made for the little that a jaw is open in f and v."""
    lips = face.lips
    teeth = face.vertices[face.assembly.slices["teeth_upper"]]
    middle = teeth[np.abs(teeth[:, 0]) < 0.008]
    edge = middle[:, 1].min()
    front = middle[middle[:, 1] < edge + 0.002][:, 2].max()
    tucked = lips.roll(0, TUCK_RINGS)
    moves = np.zeros((RING_COUNT, COLUMN_COUNT, 3))
    lower_follow = np.array([0.38, 0.52, 0.66, 0.78, 0.87, 0.94, 0.98, 1.0, 0.95, 0.75])
    upper_follow = np.array([0.55, 0.66, 0.78, 0.90, 1, 1, 1, 1, 0.95, 0.8])
    lower, upper = np.arange(13, 26), np.r_[0:12, 27:38]
    middle_vertex = lips.rings[CONTACT_RING, 19]
    drop = LABIODENTAL_JAW * face.jaw(open_deg=OPEN_DEG)[face.skin_slice][middle_vertex]
    contact = (face.skin + tucked)[middle_vertex] + drop
    goal = np.array([0, edge + BITE_M - contact[1], front - 0.0002 - contact[2]])
    moves[:, lower] = lower_follow[:, None, None] * goal * reach(lips, 0.0215, 0.5)[lower][:, None]
    lift = np.array([0, LABIODENTAL_LIFT_M, 0.0004])
    moves[:, upper] = upper_follow[:, None, None] * lift * reach(lips, 0.0215, 0.7)[upper][:, None]
    return tucked + lips.field(moves)
