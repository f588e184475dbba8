"""Lays rows of life over the curves of a mouth, and makes joint rotations of them.

What is laid over leaves the lips as they are where they meet: of the mouth's own shapes only a
breath parts them, and only where the mouth rests.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float32Array, Float64Array, FloatArray
from elocute.errors import MotionError
from elocute.head.joints import joint_index
from elocute.head.model import HeadModel
from elocute.life.director import (
    BLINK,
    BREATH,
    BROW_L,
    BROW_R,
    CHEEK_L,
    CHEEK_R,
    CORNER,
    DOWN,
    FORCE,
    INNER,
    LID,
    LIVELY,
    LOOK_DOWN,
    LOOK_LEFT,
    NOD,
    SIDE,
    SQUINT,
    TILT,
    TURN,
    WIDE,
)
from elocute.life.moods import NEUTRAL, Mood, heard_mood
from elocute.life.people import AVERAGE, Person
from elocute.life.prosody import ROW_RATE
from elocute.life.settings import Life
from elocute.life.stream import LifeStream
from elocute.motion.curves import ARKIT_NAMES, Curves
from elocute.numerics.quaternions import from_axis_angle, no_turn
from elocute.numerics.resampling import frame_places, read_rows

SIDES = ("Left", "Right")
NECK_SHARE = 0.4
"""Of a turn of the head; the rest is the head's joint's."""
HELD = 0.85  # share of a head turn that the eyes take back, so that they rest on what they look at
REACH_DEG = {"Up": 21.0, "Down": 27.0, "In": 32.0, "Out": 32.0}
"""How far the built-in head's eyeLook shapes turn the eyes at weight one."""
BREATH_JAW = 0.035  # weight of jawOpen: lips part by about a millimetre
QUIET_BREATH = 0.3  # up to here they stay together, and the nose does it
BREATH_NOD_DEG = -0.7  # the head rises a little
MOVING = 0.08  # weight of a mouth shape from which on a mouth does not rest
ROUND_KEEPS = 0.3  # share of a smile that a fully rounded mouth keeps
SPOKEN = ("jawOpen", "mouthPucker", "mouthFunnel", "mouthLabiodental")
# Shapes of a mood that an open jaw takes back, and a lip at the teeth.
CLOSED_ONLY = ("mouthPress", "mouthShrugLower")

# mm at weight one: how far corners go aside with mouth and jaw, and one of them up.
MOUTH_ASIDE_MM, JAW_ASIDE_MM, SMILE_MM = 4.9, 2.0, 6.5
UNEVEN_AT = 0.06  # weight of jawOpen between lips at which a mouth is half as uneven as it gets

Columns = dict[str, Float64Array]


@dataclass(frozen=True, eq=False)
class LivingFace:
    """A head, how much of it moves beside the mouth, and the mood and person that it shows."""

    head: HeadModel
    life: Life
    mood: Mood
    person: Person = AVERAGE

    @property
    def still(self) -> bool:
        """Whether nothing is laid over."""
        return not self.listens and self.mood == NEUTRAL

    @property
    def listens(self) -> bool:
        """Whether anything depends on the sound."""
        return self.life.any or self.mood.heard

    def stream(self, sample_rate: int) -> LifeStream:
        """A stream of its life for one sound."""
        return LifeStream(sample_rate, self.life, self.mood, self.person)

    def curves(self, curves: Curves, rows: Float32Array) -> Curves:
        """`living_curves`, where the head has the shapes and anything is laid over."""
        if self.still or "eyeBlinkLeft" not in self.head.expression_names:
            return curves
        return living_curves(curves, rows, self.life, self.mood)

    def rotations(self, rows: Float32Array) -> Float32Array | None:
        """`living_rotations`, where anything is laid over."""
        return None if self.still else living_rotations(self.head, rows, self.life, self.mood)


def rows_of_frames(
    rows: Float32Array, first_row: int, first_frame: int, count: int, fps: float
) -> Float32Array:
    """Rows (row, channel) of a `LifeStream`, of which the first is number `first_row`, at frames.

    Returns
    -------
    (frame, channel) float32
    """
    return read_rows(rows, frame_places(first_frame, count, ROW_RATE, fps) - first_row)


def living_curves(curves: Curves, rows: Float32Array, life: Life, mood: Mood) -> Curves:
    """A mouth's curves of the built-in head with the rest of the face, by life (frame, channel).

    Curves are 0 to 1; those that were not there before come last.
    """
    lived, mood = rows.astype(np.float64), _felt(mood, rows)
    names = dict.fromkeys((*curves.names, *ARKIT_NAMES))
    table = curves.select(tuple(names)).values.astype(np.float64)
    face = dict(zip(names, table.T, strict=True))
    spoken = {name: face.get(name, np.zeros(len(rows))).copy() for name in SPOKEN}
    resting = _resting(face)
    _follow_mouth(face, life.cheeks)
    _squeeze(face, life.cheeks * lived)
    _feel(face, mood.curves, spoken)
    _lean(face, life.asymmetry * lived)
    _breathe(face, lived[:, BREATH], resting, life.breath)
    _raise_brows(face, lived, life.brows * mood.brows, mood.curves.get("browDown", 0.0))
    _look(face, _eyes_deg(rows, life, mood))
    for side in SIDES:
        face[f"eyeBlink{side}"] = _over(face[f"eyeBlink{side}"], life.gaze * lived[:, LID])
    _blink(face, lived[:, BLINK])
    values = np.clip(np.stack(list(face.values()), axis=1), 0, 1)
    return Curves(values.astype(np.float32), tuple(face), curves.fps)


def living_rotations(
    head: HeadModel, rows: Float32Array, life: Life, mood: Mood
) -> Float32Array | None:
    """How life (frame, channel) turns the joints of a head.

    Joints are called neck and head, or one of them; eyes turn by joints on a head that has them and
    no eyeLook shapes.

    Returns
    -------
    (frame, joint, 4) float32 or None
        Quaternions wxyz; None for a head without such joints.
    """
    turns = np.zeros((len(rows), len(head.joint_names), 3))
    found = (_joint(head, name) for name in ("neck", "head"))  # one and the same on FLAME
    parts = [*dict.fromkeys(joint for joint in found if joint is not None)]
    shares = (NECK_SHARE, 1 - NECK_SHARE) if len(parts) == 2 else (1.0,)
    for joint, share in zip(parts, shares, strict=False):
        turns[:, joint] = share * head_turns(rows, life, mood)
    eyes = []
    if "eyeLookInLeft" not in head.expression_names:
        eyes = [_joint(head, f"eye{side}") for side in SIDES]
    for joint in eyes:
        if joint is not None:
            turns[:, joint, :2] = _eyes_deg(rows, life, mood)
    if not turns.any():
        return None
    rotations = no_turn(*turns.shape[:2])
    rotations[:] = from_axis_angle(np.radians(turns))
    return rotations


def _joint(head: HeadModel, name: str) -> int | None:
    try:
        return joint_index(head, name)
    except MotionError:
        return None


def head_turns(rows: FloatArray, life: Life, mood: Mood) -> Float64Array:
    """How the head turns, by life (frame, channel) at the frames.

    Returns
    -------
    (frame, 3) float64
        Degrees: nod (chin down), turn to the own left, tilt to the own right.
    """
    mood = _felt(mood, rows)
    turns = life.head * rows[:, [NOD, TURN, TILT]].astype(np.float64)
    turns *= np.reshape(mood.head, (-1, 1))
    turns[:, 0] += life.breath * BREATH_NOD_DEG * rows[:, BREATH]
    return turns + np.stack(np.broadcast_arrays(*mood.pose_deg), axis=-1)


def _felt(mood: Mood, rows: FloatArray) -> Mood:
    return heard_mood(mood, *rows[:, [LIVELY, FORCE]].T.astype(np.float64))


def _eyes_deg(rows: FloatArray, life: Life, mood: Mood) -> Float64Array:
    """(frame, 2) down and to the own left, in the head: what is looked at less the head's turn."""
    looked = rows[:, [LOOK_DOWN, LOOK_LEFT]].astype(np.float64)
    eyes = life.gaze * (looked - HELD * head_turns(rows, life, mood)[:, :2])
    eyes[:, 0] += mood.look_down_deg
    return eyes


def _over(below: Float64Array, above: Float64Array | float) -> Float64Array:
    """Two weights of one shape together, which never exceed one."""
    return 1 - (1 - below) * (1 - above)


def _resting(face: Columns) -> Float64Array:
    """(frame,) 1 where the mouth does nothing, 0 where it speaks."""
    mouth = [name for name in face if name.startswith(("mouth", "jaw", "tongue"))]
    most = np.max([face[name] for name in mouth], axis=0)
    return np.clip(1 - most / MOVING, 0, 1)


def _follow_mouth(face: Columns, share: float) -> None:
    """Cheeks and lids that a smile, a wide vowel or a raised lip takes along."""
    for side in SIDES:
        smile = face[f"mouthSmile{side}"] + 0.65 * face[f"mouthStretch{side}"]
        raised = face[f"mouthUpperUp{side}"]
        cheek = share * np.clip(0.55 * smile + 0.25 * raised, 0, 0.6)
        lids = share * np.clip(0.25 * smile + 0.10 * face["jawOpen"], 0, 0.3)
        face[f"cheekSquint{side}"] = _over(face[f"cheekSquint{side}"], cheek)
        face[f"eyeSquint{side}"] = _over(face[f"eyeSquint{side}"], lids)


def _squeeze(face: Columns, rows: Float64Array) -> None:
    """Cheeks and lower lids that go with stress."""
    for side, channel in zip(SIDES, (CHEEK_L, CHEEK_R), strict=True):
        face[f"cheekSquint{side}"] = _over(face[f"cheekSquint{side}"], rows[:, channel])
        face[f"eyeSquint{side}"] = _over(face[f"eyeSquint{side}"], rows[:, SQUINT])


def _feel(face: Columns, mood: Mapping[str, float], spoken: Columns) -> None:
    """Lay a mood's shapes over, as far as what is said leaves room for them."""
    rounded = np.maximum(spoken["mouthPucker"], spoken["mouthFunnel"])
    for name, weight in mood.items():
        room = np.ones_like(rounded)
        if name.startswith(("mouthSmile", "mouthDimple", "mouthFrown")):
            room -= (1 - ROUND_KEEPS) * np.clip(rounded / 0.5, 0, 1)
        elif name in CLOSED_ONLY:
            held = spoken["jawOpen"] / 0.2 + spoken["mouthLabiodental"] / 0.5
            room -= np.clip(held, 0, 1)
        for each in (name,) if name in face else (f"{name}{side}" for side in SIDES):
            face[each] = _over(face[each], weight * room)


def _lean(face: Columns, rows: Float64Array) -> None:
    """Let an open mouth be uneven; lips that meet, or meet the teeth, are even."""
    gap = np.maximum(face["jawOpen"] - face["mouthClose"], 0)
    uneven = gap**2 / (gap**2 + UNEVEN_AT**2)
    if "mouthLabiodental" in face:
        uneven *= np.clip(1 - 2 * face["mouthLabiodental"], 0, 1)
    aside = uneven * rows[:, SIDE] / (MOUTH_ASIDE_MM + JAW_ASIDE_MM)
    up = uneven * rows[:, CORNER] / SMILE_MM
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        for name, weight in (("mouth", aside), ("jaw", aside), ("mouthSmile", up)):
            face[f"{name}{side}"] = _over(face[f"{name}{side}"], np.clip(sign * weight, 0, 1))


def _breathe(face: Columns, breath: Float64Array, resting: Float64Array, share: float) -> None:
    """Part resting lips a little, flare the nostrils."""
    deep = np.clip((breath - QUIET_BREATH) / (1 - QUIET_BREATH), 0, 1)
    face["jawOpen"] = face["jawOpen"] + share * BREATH_JAW * deep * resting
    for side in SIDES:
        flared = share * 0.04 * breath * resting
        face[f"noseSneer{side}"] = _over(face[f"noseSneer{side}"], flared)


def _raise_brows(face: Columns, rows: Float64Array, share: float, held_down: float) -> None:
    """Brows, and the lids that widen with them."""
    raised = share * (1 - 0.6 * held_down)
    face["browInnerUp"] = _over(face["browInnerUp"], raised * rows[:, INNER])
    for side, channel in zip(SIDES, (BROW_L, BROW_R), strict=True):
        face[f"browOuterUp{side}"] = _over(face[f"browOuterUp{side}"], raised * rows[:, channel])
        face[f"browDown{side}"] = _over(face[f"browDown{side}"], share * rows[:, DOWN])
        face[f"eyeWide{side}"] = _over(face[f"eyeWide{side}"], raised * rows[:, WIDE])


def _look(face: Columns, eyes_deg: Float64Array) -> None:
    """Turn the eyes by the shapes for it, which take the lids along."""
    down, left = eyes_deg.T
    for side, outwards in zip(SIDES, (left, -left), strict=True):
        ways = {"Up": -down, "Down": down, "In": -outwards, "Out": outwards}
        for way, degrees in ways.items():
            name = f"eyeLook{way}{side}"
            face[name] = _over(face[name], np.clip(degrees / REACH_DEG[way], 0, 1))


def _blink(face: Columns, closure: Float64Array) -> None:
    """Shut the lids; whatever else moves them gives way, so that they meet and go no further."""
    closure = np.clip(closure, 0, 1)
    for side in SIDES:
        for name in ("eyeSquint", "eyeWide", "eyeLookUp", "eyeLookDown"):
            face[f"{name}{side}"] = face[f"{name}{side}"] * (1 - closure)
        face[f"eyeBlink{side}"] = _over(face[f"eyeBlink{side}"], closure)
