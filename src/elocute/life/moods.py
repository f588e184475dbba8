"""Moods: what a feeling makes of a face at rest and of how it moves.

After the facial action units of Ekman's emotions (FACS): happy 6 + 12, sad 1 + 4 + 15, angry
4 + 5 + 7 + 23, surprised 1 + 2 + 5. Only shapes that keep lips together are used of the mouth, so
that p, b and m stay sealed whatever the mood.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from elocute.errors import InputError
from elocute.head.feeling_shapes import FEELING_SHAPES
from elocute.one_line_repr import brief

if TYPE_CHECKING:
    from elocute.array_types import Float64Array


@dataclass(frozen=True)
class Mood:
    """What a mood adds to a face and how it changes its motion, at full intensity.

    Parameters
    ----------
    curves : mapping of str to float
        Weights of shapes at rest; names without a side are set on both.
    pose_deg : (float, float, float)
        How the head is held: nod (chin down), turn to the own left, tilt to the own right.
    look_down_deg : float
        How far below what they look at the eyes are kept.
    mouth, head, brows : float
        How far these move, as a share of what they do in no mood.
    blinks : float
        How often lids close, likewise.
    heard : bool
        Whether the rest is not yet known but told by the voice, frame by frame (`heard_mood`);
        numbers are then (frame,).
    """

    curves: Mapping[str, float] = field(default_factory=dict)
    pose_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    look_down_deg: float = 0.0
    mouth: float = 1.0
    head: float = 1.0
    brows: float = 1.0
    blinks: float = 1.0
    heard: bool = False


MOODS: dict[str, Mood] = {
    "neutral": Mood(),
    "happy": Mood(
        FEELING_SHAPES["happy"],
        pose_deg=(-1.5, 0.0, 1.0),
        mouth=1.06,
        head=1.2,
        brows=1.15,
    ),
    "sad": Mood(
        FEELING_SHAPES["sad"],
        pose_deg=(4.5, 0.0, -1.5),
        look_down_deg=7.0,
        mouth=0.84,
        head=0.6,
        brows=0.6,
        blinks=0.8,
    ),
    "angry": Mood(
        FEELING_SHAPES["angry"],
        pose_deg=(3.0, 0.0, 0.0),
        mouth=1.1,
        head=1.25,
        brows=0.5,
        blinks=0.7,
    ),
    "surprised": Mood(
        FEELING_SHAPES["surprised"],
        pose_deg=(-2.5, 0.0, 0.0),
        mouth=1.08,
        brows=0.5,
        blinks=0.75,
    ),
    "tender": Mood(
        FEELING_SHAPES["tender"],
        pose_deg=(1.5, 0.0, 4.0),
        mouth=0.9,
        head=0.75,
        brows=0.8,
        blinks=0.9,
    ),
}
NEUTRAL, AUTO = MOODS["neutral"], Mood(heard=True)
# What a voice tells: how varied it is and how much effort is in it. No valence: there is no smile.
CALM = Mood({"eyeBlink": 0.04}, head=0.75, brows=0.7)
LIVELY = Mood(
    {"browOuterUp": 0.10, "browInnerUp": 0.06, "eyeWide": 0.10, "cheekSquint": 0.12},
    pose_deg=(-1.0, 0.0, 0.0),
    head=1.3,
    brows=1.3,
)
FORCEFUL = Mood(
    {"browDown": 0.42, "eyeSquint": 0.24, "noseSneer": 0.14},
    pose_deg=(1.5, 0.0, 0.0),
    head=1.35,
    brows=0.8,
)
ALLOWED = f"auto, or {', '.join(MOODS)}, with an intensity from 0 to 1 or without, as in happy:0.6"


def resolve_mood(given: str | Mood) -> Mood:
    """The Mood that a caller names.

    Parameters
    ----------
    given : str or Mood
        A name of MOODS ("happy"), one with an intensity from 0 to 1 ("happy:0.6"), several whose
        intensities sum to one at most ("sad:0.5,tender:0.4"), "auto" for what the voice tells, or a
        Mood, which is returned as it is.

    Returns
    -------
    Mood

    Raises
    ------
    InputError
        Naming what is allowed.
    """
    if isinstance(given, Mood):
        return given
    if not isinstance(given, str):
        raise InputError.about("`mood`", found=brief(given), allowed=ALLOWED)
    if given.strip() == "auto":
        return AUTO
    shares: dict[str, float] = {}
    for part in given.split(","):
        name, colon, number = part.strip().partition(":")
        share = _number(number) if colon else 1.0
        if name not in MOODS or not 0 <= share <= 1 or name in shares:
            raise InputError.about("`mood`", found=brief(part.strip()), allowed=ALLOWED)
        shares[name] = share
    if sum(shares.values()) > 1 + 1e-9:
        raise InputError.about(
            "`mood`", found=f"{given[:60]!r}", allowed="intensities that sum to 1 at most"
        )
    return _mixed([(MOODS[name], share) for name, share in shares.items()])


def heard_mood(mood: Mood, lively: Float64Array, force: Float64Array) -> Mood:
    """The mood of frames.

    Parameters
    ----------
    mood : Mood
        What was chosen; all but AUTO are returned as they are.
    lively, force : (frame,) float64
        How varied the voice is, and how much effort is in it, 0 to 1.

    Returns
    -------
    Mood
        For AUTO with numbers (frame,).
    """
    if not mood.heard:
        return mood
    easy = 1 - force
    shares = ((CALM, (1 - lively) * easy), (LIVELY, lively * easy), (FORCEFUL, force))
    return _mixed(shares)


def _mixed(parts: Sequence[tuple[Mood, Any]]) -> Mood:
    """Moods of these intensities together; what is left of one is neutral."""
    names = dict.fromkeys(name for mood, _ in parts for name in mood.curves)

    def scaled(aspect: str) -> Any:
        return 1 + sum(share * (getattr(mood, aspect) - 1) for mood, share in parts)

    nod, turn, tilt = (
        sum(share * mood.pose_deg[axis] for mood, share in parts) for axis in range(3)
    )
    return Mood(
        {name: sum(share * mood.curves.get(name, 0.0) for mood, share in parts) for name in names},
        (nod, turn, tilt),
        sum(share * mood.look_down_deg for mood, share in parts),
        *(scaled(aspect) for aspect in ("mouth", "head", "brows", "blinks")),
    )


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return -1.0
