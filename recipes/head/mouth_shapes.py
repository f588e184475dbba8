"""Jaw and lips."""

from __future__ import annotations

import numpy as np

from elocute.numerics.smoothing import smoothstep
from recipes.head.anatomy import CONTACT_RING, CORNERS
from recipes.head.face import NeutralFace
from recipes.head.jaw import FORWARD_M, OPEN_DEG, SIDE_DEG
from recipes.head.lip_forms import LOWER_MIDDLE, Aperture, aperture_moves, carried_block, reach
from recipes.head.lips import COLUMN_COUNT, FOLLOW, PAIRS, RING_COUNT, Lips
from recipes.head.pulls import Fold, Pull, both_sides, pulled
from recipes.head.tongue import along

FUNNEL = Aperture(
    half_width=14.0,
    above=4.8,
    below=4.6,
    drop=0.9,
    forward=8.0,
    corner_back=6.0,
    evert_deg=24,
    fullness=1.5,
    thickness=0.92,
    taper=0.20,
    roundness=0.80,
    hole=0.90,
    corner_full=0.6,
)
PUCKER = Aperture(
    half_width=10.0,
    above=0.7,
    below=0.45,
    drop=2.5,
    forward=10.0,
    corner_back=6.5,
    evert_deg=14,
    fullness=1.8,
    thickness=0.90,
    taper=0.45,
    roundness=0.75,
    hole=0.62,
    pinch=0.5,
    corner_full=0.75,
)
TONGUE_SINKS_M, TONGUE_SINKS_AT = 0.0045, (0.25, 0.30)
"""How far the back of the tongue sinks while the jaw is wide open; where along it, and how wide."""
CORNERS_FALL_M, CORNERS_IN_M = 0.0080, 0.0055
"""How far the corners fall with a wide open jaw, besides what its bone draws them, and how far they
come in: a mouth opens round."""
HELD_LOWERED, HELD_RAISED = 0.84, 0.86
"""Shares of the way to a corner up to which lips part when the lower lip is drawn down, and when
the upper one is raised: beside the corners they stay on each other, and the hole ends round, not in
a needle."""
LOWERED_FULL, DRAWN_M = 0.92, 0.013
"""How far the border of a lower lip that is drawn down falls, as a share of its edge's fall, and
how far below it the skin goes with it."""
LOWERED_CORNER_M, STRETCHED_CORNER_M, SAG = 0.0024, 0.0012, 2.4
"""How far a corner comes down with a lower lip that is drawn down, and with a stretched mouth, and
the power of the way to it by which both lips do."""
STRETCHED_CHEEK = (
    Pull((42, -51), (-4.6, -5.0, -3.4), (15, 18)),
    Pull((58, -64), (-2.0, -6.0, 0.0), (14, 16)),
)
"""What a wide open jaw does to the cheek: it is drawn long and falls in between cheekbone and jaw,
and the flesh over the jaw's corner comes down with it."""
BELOW_M, BESIDE_M = 0.008, 0.016
"""Depth under the line of the lips from which what pulls the lower lip down is whole, and the
distance beside the corners from which it is nothing."""
SUCKED = {"mouthFunnel": 0.35, "mouthPucker": 0.85}
"""How far cheeks are drawn in while lips are round, of MakeHuman's sucked cheeks."""
LIFTED = (
    Pull((33, -27), (0.4, 5.4, 4.2), (12, 10)),
    Pull((51, -25), (-0.5, 3.0, 1.2), (11, 11)),
    Pull((44, -40), (1.4, 3.8, 2.4), (12, 13)),
    Pull((43, -69), (0.8, 2.0, -1.4), (9, 11)),
    Pull((34, -48), (-1.2, -0.6, 0.6), (8, 9)),
    Fold(((17, -40), (22, -47), (29, -55), (35, -64)), 1.2, 2.2, 3.8),
)
"""What a smile does beside the mouth: the cheek's apple rises and bunches below the eye, the cheek
under it and beside the corner follows the corner, and a fold runs from the nose's wing round it,
over which the cheek bunches."""
LID_RAISED = 0.36
"""Of MakeHuman's raised lower lid in a smile."""
STRETCHED = (
    Fold(((33, -54), (36, -65), (33, -77)), 1.0, 0.9, 4.0),
    Pull((40, -84), (3.0, -2.0, 0.0), (14, 13)),
)
DIMPLED = (Fold(((31, -56), (34, -64), (32, -72)), 1.5, 1.2, 4.0),)
"""What a stretched and a dimpled mouth do beside the corners."""
FROWN_CORNER_M = np.array([0.0006, -0.0062, -0.0014])
FROWN_MIDDLE_M, FROWN_ARC = np.array([0, 0.0018, 0.0004]), 1.8
"""Where a frown draws the corners and the middle of the mouth, and the power of the way to the
corner by which the lips bend."""
FROWN_FULL_M = np.array([0, -0.00045, 0.0009])
"""How far the red of the lower lip is pushed down and out."""
FROWNED = (
    Fold(((29, -69), (31, -79), (28, -90)), 1.4, 1.3, 3.4),
    Pull((34, -72), (0.4, -2.2, 0.6), (10, 12)),
    Pull((0, -88), (0, 2.2, 1.6), (14, 9)),
)
"""What a frown does beside the mouth: a soft fold down from the corner, the cheek over it sags, and
the chin lifts the lip."""
UPPER_UP_M, UPPER_BACK_M = 0.0067, 0.0012
"""How far the middle of the upper lip's edge rises, and how far its border goes back with it."""
RAISED_FULL = 0.8
"""How far the border of a raised upper lip rises, as a share of its edge's rise."""
SIDES_UP = (
    Pull((14, -43), (0.4, 1.2, 0.2), (7, 7)),
    Fold(((17, -40), (22, -46), (28, -53)), 0.8, 1.0, 3.4),
)
"""What a raised upper lip does beside itself: the nose's wing follows a little, the fold beside it
deepens."""
PRESSED_CHIN = (Pull((0, -90), (0, 2.0, 1.0), (15, 9)),)
SMILE_ARC_M = 0.0013
"""How far lips lie under the straight line from the middle to a corner of a smile."""
SMILE_UP_M = 0.0013
"""How far the middle of both lips rises in a smile: it shows more of the upper teeth."""
SMILE_ARC, SMILE_RISE, SMILE_THIN = 2.0, 1.2, (0, 0.10, 0.2)
"""Near the corners of a smile: the power of the way to the corner by which the lips bend, how high
the corner rises, of MakeHuman's, and shares of their height and depth that lips lose."""
SMILE_OWN, SMILE_BENT = 0.25, 0.8
"""Shares of the way to a corner up to which lips smile as MakeHuman's, and from which so."""
SMILE_EVENINGS = 3
"""How often the skin of a smile is evened out: MakeHuman's has a ridge beside the corners."""
EVEN = 0.7
"""Share of the bow of resting lips that evenly bent ones lose: it would be an angle in an arc."""
THINNER = {"mouthSmile": 0.15, "mouthStretch": 0.25, "mouthDimple": 0.18}
"""Share of their height that lips lose while corners are drawn apart."""
SHRUG_FORWARD_M = 0.0022
"""How far the upper lip is pushed out in a shrug."""
CLOSED_DROP_M, CLOSED_BACK_M = 0.009, 0.002
"""Where the sealed lips are while the jaw is wide open."""
LABIODENTAL_LIFT_M, LABIODENTAL_JAW = 0.0003, 0.04
"""How far the upper lip rises in f, and the jaw's opening that this is made for. The lower one
meets the incisors' edges."""
ROLLED, ROLLED_REACH, LIFTED_REACH = (0.84, 0.80), (0.0235, 0.6), (0.0170, 1.8)
"""What is left of the lower lip's height and fullness then, and how far to the sides it is rolled
in and the upper one lifted; see `reach`."""
BITTEN_REACH = (0.0140, 0.8)
"""How far to the sides the lower lip lies under the teeth, not under the upper lip."""
BUNCHED_CHIN = (Pull((0, -88), (0, 2.6, 1.8), (15, 8)), Pull((0, -78), (0, 0.8, -0.8), (14, 4)))
"""The chin lifts the lip."""
PRESS_RINGS, PRESS_M, PRESS_MORE_M = 2.0, 0.0003, 0.0019
"""Pressed lips: rings rolled in, overlap at the corners, and what the middle has more, so that p
closes on a neighbour's round hole."""


def mouth_shapes(face: NeutralFace) -> dict[str, np.ndarray]:
    shapes = {
        "jawOpen": _jaw_open(face),
        "jawForward": face.jaw(shift=(0, 0, FORWARD_M)),
        "jawLeft": face.jaw(side_deg=SIDE_DEG),
        "jawRight": face.jaw(side_deg=-SIDE_DEG),
    }
    skin = _round_shapes(face) | _closing_shapes(face, shapes["jawOpen"][face.skin_slice])
    skin |= _sided_shapes(face)
    skin["mouthLabiodental"] = _labiodental(face)
    return shapes | {name: face.of_skin(moved) for name, moved in skin.items()}


def _jaw_open(face: NeutralFace) -> np.ndarray:
    """The jaw falls, the back of the tongue sinks and leaves the throat open."""
    moved = face.jaw(open_deg=OPEN_DEG)
    where = face.assembly.slices["tongue"]
    back = (along(face.vertices[where]) - TONGUE_SINKS_AT[0]) / TONGUE_SINKS_AT[1]
    moved[where, 1] -= TONGUE_SINKS_M * np.exp(-(back**2))
    rounded = _opened_round(face.lips, (face.vertices + moved)[face.skin_slice])
    cheeks = face.off_the_lips(_beside(face, *STRETCHED_CHEEK))
    return moved + face.of_skin(face.lips.field(rounded) + cheeks)


def _opened_round(lips: Lips, opened: np.ndarray) -> np.ndarray:
    """(ring, column, 3) m: what makes an ellipse of the mouth that the jaw's bone has opened."""
    contact, across = opened[lips.rings[CONTACT_RING]], lips.across
    middle = np.full(COLUMN_COUNT, contact[0, 1])
    middle[CORNERS[0] + 1 : CORNERS[1]] = contact[LOWER_MIDDLE, 1]
    corner = contact[list(CORNERS), 1].mean() - CORNERS_FALL_M
    ellipse = corner + (middle - corner) * _parted(across, 1.0)
    moves = np.zeros((RING_COUNT, COLUMN_COUNT, 3))
    moves[:, :, 0] = -CORNERS_IN_M * across
    moves[:, :, 1] = ellipse - contact[:, 1]
    return moves


def _parted(across: np.ndarray, held: float) -> np.ndarray:
    """(column,) how far a lip leaves the other: an ellipse that ends at `held` of the way to the
    corners."""
    return np.sqrt(np.clip(1 - (across / held) ** 2, 0, 1))


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
    """What a smile does beside the mouth: cheeks and lower lids rise, the nose stays."""
    lids = face.pose_unit("LeftLowerLidUp") + face.pose_unit("RightLowerLidUp")
    return LID_RAISED * lids + face.off_the_lips(_beside(face, *LIFTED))


def _curved(face: NeutralFace) -> np.ndarray:
    """Both lips lower between the middle and the corners: a smile is an arc, no angle."""
    across = np.abs(face.lips.across)
    moves = np.zeros((RING_COUNT, COLUMN_COUNT, 3))
    moves[:, :, 1] = SMILE_UP_M * (1 - across**2) - SMILE_ARC_M * 4 * across * (1 - across)
    return face.lips.field(moves)


def _bent(lips: Lips, corner: np.ndarray, middle: np.ndarray, power: float) -> np.ndarray:
    """(column, 3) m: how both lips go if their middle and left corner go there and they bend
    evenly between."""
    across = np.abs(lips.across)
    share = np.stack([across, across**power, across**2], 1)
    bent = middle + share * (corner - middle)
    bent[:, 0] *= np.sign(lips.across)
    line = lips.rest[lips.rings[CONTACT_RING], 1]
    arc = line[LOWER_MIDDLE] + share[:, 1] * (line[CORNERS[0]] - line[LOWER_MIDDLE])
    bent[:, 1] -= EVEN * (line - arc)
    return bent


def _frowning_lips(face: NeutralFace) -> np.ndarray:
    """Corners fall in an arc, the lower lip is pushed out."""
    lips = face.lips
    bent = _bent(lips, FROWN_CORNER_M, FROWN_MIDDLE_M, FROWN_ARC)
    moves = np.repeat(bent[None], RING_COUNT, axis=0)
    lower = np.arange(CORNERS[0] + 1, CORNERS[1])
    red = np.sin(np.pi * np.arange(CONTACT_RING + 1) / CONTACT_RING)[:, None]
    full = red * (1 - lips.across[lower] ** 2)
    moves[: CONTACT_RING + 1, lower] += full[..., None] * FROWN_FULL_M
    moves[CONTACT_RING:] *= FOLLOW[CONTACT_RING:, None, None]
    return lips.field(moves)


def _evened_smile(face: NeutralFace, smile: np.ndarray) -> np.ndarray:
    """A smile whose skin has no steps, and whose lips bend evenly and keep their red up to the
    corners: MakeHuman's end in long points."""
    lips = face.lips
    own, soft = smile[lips.rings], face.softened(smile, SMILE_EVENINGS)
    contact = own[CONTACT_RING]
    right, left = contact[CORNERS[1]], contact[CORNERS[0]]
    corner = (left + right * [-1, 1, 1]) / 2 * [1, SMILE_RISE, 1]
    middle = (contact[0] + contact[LOWER_MIDDLE]) / 2 * [0, 1, 1]
    bent = _bent(lips, corner, middle, SMILE_ARC)
    offset = face.skin[lips.rings] - face.skin[lips.rings[CONTACT_RING]]
    wanted = bent - offset * SMILE_THIN
    wanted[CONTACT_RING + 1 :] = bent * FOLLOW[CONTACT_RING + 1 :, None, None]
    way = (np.abs(lips.across) - SMILE_OWN) / (SMILE_BENT - SMILE_OWN)
    share = smoothstep(np.clip(way, 0, 1))[:, None]
    return soft + lips.field(own + share * (wanted - own) - soft[lips.rings])


def _flattened(face: NeutralFace, share: float) -> np.ndarray:
    """The red of both lips loses a share of its height, towards the line where they meet."""
    rings = face.lips.rings
    offset = face.skin[rings] - face.skin[rings[CONTACT_RING]]
    offset[CONTACT_RING + 1 :] = 0
    return face.lips.field(-offset * [0, share, share / 2])


def _beside(face: NeutralFace, *parts: Pull | Fold) -> np.ndarray:
    """What these do on both sides."""
    sides = both_sides(face, pulled(face, *parts))
    return sides["Left"] + sides["Right"]


def _pushed_out(face: NeutralFace) -> np.ndarray:
    """The upper lip forward, most in the middle."""
    upper = np.r_[0 : CORNERS[0], CORNERS[1] + 1 : COLUMN_COUNT]
    moves = np.zeros((RING_COUNT, COLUMN_COUNT, 3))
    moves[:, upper, 2] = SHRUG_FORWARD_M * reach(face.lips, 0.021)[upper]
    return face.lips.field(moves)


def _closing_shapes(face: NeutralFace, jaw_open: np.ndarray) -> dict[str, np.ndarray]:
    lips = face.lips
    uppers = [upper for upper, _ in PAIRS]
    press = lips.roll(PRESS_RINGS, PRESS_RINGS)
    press = press + pulled(face, *PRESSED_CHIN)
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
        "mouthShrugUpper": face.resealed(face.pose_unit("UpperLipUp") * 1.05 + _pushed_out(face)),
        **{f"mouthPress{side}": half for side, half in face.halves(press).items()},
    }


def _sided_shapes(face: NeutralFace) -> dict[str, np.ndarray]:
    apart = face.expression("mouth-retraction")
    smile = face.expression("mouth-corner-puller") * [1, 0.60, 1] + apart * [0.65, 0, 0.5]
    thin = {name: _flattened(face, share) for name, share in THINNER.items()}
    dimpled = face.expression("mouth-compression") * [0.6, 0.3, 0.6] + apart * [0.55, 0.1, 0.6]
    sources = {
        "mouthSmile": face.resealed(_evened_smile(face, smile + thin["mouthSmile"] + _curved(face)))
        + _smiling_cheeks(face),
        "mouthFrown": face.resealed(_frowning_lips(face))
        + face.off_the_lips(_beside(face, *FROWNED)),
        "mouthStretch": face.resealed(
            apart * [1.5, 0.1, 0.9] + thin["mouthStretch"] + _sagged(face, STRETCHED_CORNER_M)
        )
        + face.off_the_lips(_beside(face, *STRETCHED)),
        "mouthDimple": face.resealed(dimpled + thin["mouthDimple"])
        + face.off_the_lips(_beside(face, *DIMPLED)),
        "mouthLowerDown": _lower_half(face, face.expression("mouth-depression-retraction")),
        "mouthUpperUp": _upper_lip_up(face),
    }
    return {
        name + side: half
        for name, moved in sources.items()
        for side, half in face.halves(face.lips.evened_corners(moved)).items()
    }


def _upper_lip_up(face: NeutralFace) -> np.ndarray:
    """The upper lip rises in an arc and keeps its bow; corners and lower lip stay."""
    upper = np.r_[0 : CORNERS[0], CORNERS[1] + 1 : COLUMN_COUNT]
    arc = _parted(face.lips.across[upper], HELD_RAISED)
    moves = np.zeros((RING_COUNT, COLUMN_COUNT, 3))
    share = RAISED_FULL + (1 - RAISED_FULL) * (FOLLOW - FOLLOW[0]) / (1 - FOLLOW[0])
    moves[:, upper, 1] = UPPER_UP_M * share[:, None] * arc
    moves[:, upper, 2] = -UPPER_BACK_M * ((1 - FOLLOW) / (1 - FOLLOW[0]))[:, None] * arc
    moves[CONTACT_RING:, :, 2] = 0
    return face.lips.field(moves) + face.off_the_lips(_beside(face, *SIDES_UP))


def _sagging(lips: Lips, corner_m: float) -> np.ndarray:
    """(column,) m: how both lips rise (less than 0) where their corners come down so far."""
    return -corner_m * np.abs(lips.across) ** SAG


def _sagged(face: NeutralFace, corner_m: float) -> np.ndarray:
    """The skin's displacement by lips whose corners come down."""
    moves = np.zeros((RING_COUNT, COLUMN_COUNT, 3))
    moves[:, :, 1] = _sagging(face.lips, corner_m)
    return face.lips.field(moves)


def _lower_half(face: NeutralFace, displacement: np.ndarray) -> np.ndarray:
    """What a displacement does to the lower lip and below; the upper lip stays.

    The skin under the lip comes down with it: MakeHuman's lip is thinned to two thirds, people's
    are as full as before.
    """
    lips = face.lips
    contact = face.skin[lips.rings[CONTACT_RING]]
    line = np.interp(np.abs(face.skin[:, 0]), np.abs(contact[:13, 0]), contact[:13, 1])
    depth = line - face.skin[:, 1]
    below = smoothstep(np.clip(depth / BELOW_M, 0, 1))
    beside = np.abs(face.skin[:, 0]) - np.abs(contact[:, 0]).max()
    near = 1 - smoothstep(np.clip(beside / BESIDE_M, 0, 1))
    border, middle = lips.rings[0], lips.rings[CONTACT_RING, LOWER_MIDDLE]
    more = LOWERED_FULL * displacement[middle, 1] / displacement[border[LOWER_MIDDLE], 1] - 1
    chin = depth - depth[border[LOWER_MIDDLE]]
    drawn = 1 + more * np.exp(-((np.maximum(chin, 0) / DRAWN_M) ** 2))
    kept = displacement * (below * near)[:, None]
    kept[:, 1] *= drawn
    moves = np.zeros((RING_COUNT, COLUMN_COUNT, 3))
    lower = np.arange(CORNERS[0] + 1, CORNERS[1])
    moves[:, lower] = displacement[lips.rings[:, lower]]
    fall = moves[CONTACT_RING, LOWER_MIDDLE, 1]
    arc = fall * _parted(lips.across[lower], HELD_LOWERED)
    # The border of the red keeps its curve: it would else have a shoulder beside the corners.
    follow = np.clip(np.arange(RING_COUNT) / CONTACT_RING, 0, 1)[:, None]
    border_fall = (1 + more) * moves[0, lower, 1]
    moves[:, lower, 1] = border_fall + follow * (arc - border_fall)
    moves[:, :, 1] += _sagging(lips, LOWERED_CORNER_M)
    return kept + lips.field(moves - kept[lips.rings])


def _labiodental(face: NeutralFace) -> np.ndarray:
    """The lower lip rolls in until its inner side lies on the edge of the upper incisors; the
    upper lip lies close above it. Made for the little that a jaw is open in f and v."""
    lips = face.lips
    teeth = face.vertices[face.assembly.slices["teeth_upper"]]
    middle = teeth[np.abs(teeth[:, 0]) < 0.008]
    edge = middle[:, 1].min()
    front = middle[middle[:, 1] < edge + 0.002][:, 2].max()
    rest = face.skin[lips.rings]
    offset = rest - rest[CONTACT_RING]
    offset[CONTACT_RING + 1 :] = 0
    rolled = offset * (np.array([1, *ROLLED]) - 1) * reach(lips, *ROLLED_REACH)[:, None]
    moves = np.zeros((RING_COUNT, COLUMN_COUNT, 3))
    upper_follow = np.array([0.55, 0.66, 0.78, 0.90, 1, 1, 1, 1, 0.95, 0.8])
    lower_up = np.array([1, 1, 1, 1, 1, 1, 1, 1, 0.95, 0.75])
    # The edge goes back to the teeth; the border of the red stands where it stood.
    lower_back = np.array([0.15, 0.25, 0.4, 0.6, 0.75, 0.9, 1, 1, 0.95, 0.75])
    lower_follow = np.stack([lower_up, lower_up, lower_back], axis=1)
    lower, upper = np.arange(13, 26), np.r_[0:12, 27:38]
    middle_vertex = lips.rings[CONTACT_RING, 19]
    drop = LABIODENTAL_JAW * _jaw_open(face)[face.skin_slice][middle_vertex]
    contact = face.skin[middle_vertex] + drop
    goal = np.array([0, edge - contact[1], front - contact[2]])
    bitten = reach(lips, *BITTEN_REACH)[lower][:, None]
    moves[:, lower] = rolled[:, lower] + lower_follow[:, None] * goal * bitten
    lift = np.array([0, LABIODENTAL_LIFT_M, 0.0006])
    lifted = reach(lips, *LIFTED_REACH)[upper][:, None]
    moves[:, upper] = upper_follow[:, None, None] * lift * lifted
    return lips.field(moves) + face.off_the_lips(_beside(face, *BUNCHED_CHIN) / 2)
