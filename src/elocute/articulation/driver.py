"""The rule-based driver: posteriors of phones in, ARKit-space curves out.

Path of the data: posteriors → co-articulated curves → rest gate → labiodental → closure →
style. Contacts come last and win, because a lip that misses a p is seen at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.array_types import FloatArray
from elocute.articulation.coarticulation import DIPHTHONG_S, REACH_S, coarticulate
from elocute.articulation.contacts_and_rest import (
    CLOSING_S,
    CONTACT_S,
    HOLD_MAX_S,
    SPEECH_AT_LEAST_S,
    WAIT_S,
    WAKE_S,
    contact_evidence,
    contact_gate,
    speech_gate,
)
from elocute.articulation.phone_targets import curve_names
from elocute.articulation.settings import AnimationSettings
from elocute.articulation.style import PLAIN, Style
from elocute.encoders.phones_and_visemes import BILABIALS, LABIODENTALS, PHONES, SILENCE
from elocute.errors import InputError
from elocute.head.viseme_shapes import LABIODENTAL, VISEME_SHAPES
from elocute.motion.curves import Curves
from elocute.numerics.smoothing import smoothstep
from elocute.one_line_repr import brief
from elocute.settings import setting_of

# Curves that part the lips: a closure takes them away altogether.
PARTING = (
    "mouthFunnel",
    "mouthLowerDownLeft",
    "mouthLowerDownRight",
    "mouthUpperUpLeft",
    "mouthUpperUpRight",
    "mouthStretchLeft",
    "mouthStretchRight",
    "mouthShrugUpper",
)
JAW_LEFT_IN_CLOSURE = 0.30  # share of the neighbours' jaw opening that a p keeps behind its lips
# Over which the lower lip reaches the teeth no more.
BITTEN_MOST = {"jawOpen": 0.12, "mouthPucker": 0.08}
HELD_FROM = 0.7  # of a contact that is asked for: from there on it is made
ONE_SIDED_SMILE = 0.45  # of a whole unit of asymmetry, on the side that it favours
CHEEK_OF_SMILE = 0.6  # how much a smile lifts the cheek
ASYMMETRY_REACH = 0.35  # how much a whole unit of asymmetry takes from one side

FRAME_S = 0.04  # two rows of posteriors: what averages and edges add
LOOKAHEAD_S = FRAME_S + max(
    REACH_S + DIPHTHONG_S,
    WAIT_S + HOLD_MAX_S / 2 + CLOSING_S + CONTACT_S,
    WAKE_S + SPEECH_AT_LEAST_S,
)
"""Posteriors are looked at no further ahead of a frame than this."""
HISTORY_S = 2.0
"""And no further back: a stretch that begins so much earlier gives the same frames."""


def articulate(
    log_posteriors: FloatArray,
    rate: float,
    *,
    frame_count: int | None = None,
    fps: float = 60.0,
    style: Style | None = None,
    strength: float = 1.0,
    first_frame: int = 0,
    first_row: int = 0,
    contacts: bool = True,
) -> Curves:
    """Curves of a face that says the phones in `log_posteriors`.

    Parameters
    ----------
    log_posteriors : (row, 40)
        Natural logarithms in the order of PHONES; row k is at (first_row + k) / rate.
    rate : float
        Rows per second.
    frame_count : int, optional
        Frames of the result; the whole length by default.
    fps : float
        Frames per second.
    style : Style, optional
        How the person articulates; plain by default.
    strength : float
        How far the mouth moves, 0 to 2; it does not change whether the lips close.
    first_frame, first_row : int
        For a stretch of a longer take: its first frame, with rows from HISTORY_S before it to
        LOOKAHEAD_S after it.
    contacts : bool
        Whether lips close on p, b and m, meet the teeth on f and v, and rest in pauses by rule;
        otherwise there is only what coarticulation and style make of the phones.

    Returns
    -------
    Curves
        0 to 1, named after ARKit and three shapes for speech.

    Raises
    ------
    InputError
        For a strength out of range, and posteriors of another shape.
    """
    style = style or PLAIN
    known = setting_of(AnimationSettings, "strength")
    if not known.holds(strength):
        raise InputError.about("`strength`", found=brief(strength), allowed=known.allowed)
    if log_posteriors.ndim != 2 or log_posteriors.shape[1] != len(PHONES):
        raise InputError.about(
            "posteriors", found=f"shape {log_posteriors.shape}", allowed=f"(frames, {len(PHONES)})"
        )
    if frame_count is None:
        frame_count = max(1, round(len(log_posteriors) / rate * fps))
    posteriors = np.exp(log_posteriors).astype(np.float32)
    values = coarticulate(
        posteriors,
        rate,
        frame_count,
        fps,
        style.anticipation_s,
        style.carry_s,
        first_frame=first_frame,
        first_row=first_row,
    )
    curves = dict(zip(curve_names(), np.ascontiguousarray(values.T), strict=True))
    _apply_style(curves, style, strength)
    position = _TakePosition(first_frame, first_row)
    if contacts:
        _lay_contacts(curves, posteriors, rate, fps, style, position)
    _pose(curves, style)
    _lean(curves, style.asymmetry)
    return _limited(curves, fps)


def make_contacts(
    curves: Curves,
    log_posteriors: FloatArray,
    rate: float,
    style: Style | None = None,
    *,
    first_frame: int = 0,
    first_row: int = 0,
) -> Curves:
    """Add the driver's rests and contacts to another model's curves of the built-in head.

    Regression averages over what it is unsure of, so the lips of a trained model nearly meet where
    they should; after this they do. All but the curves is as `articulate` takes it.
    """
    posteriors = np.exp(log_posteriors).astype(np.float32)
    position, style = _TakePosition(first_frame, first_row), style or PLAIN
    columns = _columns(curves)
    _lay_contacts(columns, posteriors, rate, curves.fps, style, position)
    return _limited(columns, curves.fps)


def finish_decoded(
    curves: Curves,
    seals: FloatArray,
    teeth: FloatArray,
    style: Style,
) -> Curves:
    """Make the contacts of curves exact that nearly have them, then add what a style adds.

    The curves are of the built-in head; `seals` and `teeth` (frame,) say how far the lips are shut,
    and the lower lip is at the upper teeth, 0 to 1.
    """
    columns = _columns(curves)
    _bite(columns, _held(teeth))
    _press_lips(columns, seals)
    _close_lips(columns, _held(seals), jaw_left=1.0)
    _pose(columns, style)
    _lean(columns, style.asymmetry)
    return _limited(columns, curves.fps)


def _held(gate: FloatArray) -> FloatArray:
    """The middle of a contact, without the way to it and from it."""
    return smoothstep(np.clip((gate - HELD_FROM) / (1 - HELD_FROM), 0, 1))


def _columns(curves: Curves) -> dict[str, FloatArray]:
    """A copy of each curve by name, those of the driver among them."""
    wanted = dict.fromkeys((*curves.names, *curve_names()))
    table = curves.select(tuple(wanted)).values.T.copy()
    return dict(zip(wanted, table, strict=True))


@dataclass(frozen=True)
class _TakePosition:
    """Where a stretch of frames and its rows of posteriors lie in a take."""

    first_frame: int
    first_row: int


def _lay_contacts(
    curves: dict[str, FloatArray],
    posteriors: FloatArray,
    rate: float,
    fps: float,
    style: Style,
    position: _TakePosition,
) -> None:
    """Rest, labiodental and bilabial contacts, in this order."""
    frame_count = len(curves["jawOpen"])
    frames = np.arange(position.first_frame, position.first_frame + frame_count)
    times_s = frames / fps - position.first_row / rate  # since the first row
    speech = speech_gate(posteriors[:, SILENCE], rate, times_s)
    for name in curves:
        curves[name] = curves[name] * speech
    teeth = _contact(posteriors, LABIODENTALS, rate, times_s, style) * speech
    _replace(curves, LABIODENTAL, teeth)
    _close_lips(curves, _contact(posteriors, BILABIALS, rate, times_s, style) * speech)


def _limited(curves: dict[str, FloatArray], fps: float) -> Curves:
    table = np.stack(list(curves.values()), axis=1)
    return Curves(np.clip(table, 0, 1), tuple(curves), fps)


def _contact(
    posteriors: FloatArray, phones: tuple[str, ...], rate: float, times_s: FloatArray, style: Style
) -> FloatArray:
    silence = posteriors[:, SILENCE]
    posterior = posteriors[:, [PHONES.index(phone) for phone in phones]].sum(axis=1)
    threshold = style.closure if phones is BILABIALS else style.labiodental
    evidence = contact_evidence(posterior, silence)
    return contact_gate(evidence, silence, rate, times_s, threshold, style.hold_s)


def _apply_style(curves: dict[str, FloatArray], style: Style, strength: float) -> None:
    for name in curves:
        factor = strength
        if name == "jawOpen" or name.startswith("mouthLowerDown"):
            factor *= style.amplitude
        elif name.startswith("mouthUpperUp"):
            factor *= style.upper_lip * style.amplitude
        elif name in ("mouthPucker", "mouthFunnel"):
            factor *= style.rounding
        elif name.startswith(("mouthStretch", "mouthSmile", "mouthDimple")):
            factor *= style.spread
        curves[name] = np.clip(curves[name] * factor, 0, 1)


def _bite(curves: dict[str, FloatArray], gate: FloatArray) -> None:
    """The lower lip meets the teeth; jaw and rounding stay as far as it can."""
    for name in PARTING:
        if name in curves:
            curves[name] *= 1 - gate
    curves["mouthLabiodental"] = np.maximum(curves["mouthLabiodental"], gate)
    for name, most in BITTEN_MOST.items():
        curves[name] = np.minimum(curves[name], 1 - gate * (1 - most))
    curves["jawOpen"] = np.maximum(curves["jawOpen"], gate * LABIODENTAL["jawOpen"])
    close = np.maximum(curves["jawOpen"] - LABIODENTAL["jawOpen"], 0)
    curves["mouthClose"] = (1 - gate) * curves["mouthClose"] + gate * close


def _press_lips(curves: dict[str, FloatArray], gate: FloatArray) -> None:
    """The lower lip leaves the teeth, and lips are pressed as in p."""
    if "mouthLabiodental" in curves:
        curves["mouthLabiodental"] *= 1 - gate
    for name, weight in VISEME_SHAPES["PP"].items():
        if name not in ("jawOpen", "mouthClose"):
            curves[name] = np.maximum(curves.get(name, np.zeros_like(gate)), gate * weight)


def _close_lips(
    curves: dict[str, FloatArray], gate: FloatArray, jaw_left: float = JAW_LEFT_IN_CLOSURE
) -> None:
    """Seal the lips: parting curves go, the jaw rises, mouthClose takes up what it leaves."""
    for name in PARTING:
        if name in curves:
            curves[name] *= 1 - gate
    _press_lips(curves, gate)
    curves["jawOpen"] *= 1 - gate * (1 - jaw_left)
    # ARKit's mouthClose seals the lips where it equals jawOpen.
    curves["mouthClose"] = (1 - gate) * curves["mouthClose"] + gate * curves["jawOpen"]


def _replace(curves: dict[str, FloatArray], shape: dict[str, float], gate: FloatArray) -> None:
    for name in curves:
        curves[name] = curves[name] * (1 - gate) + gate * shape.get(name, 0.0)


def _pose(curves: dict[str, FloatArray], style: Style) -> None:
    """Add a style's constant smile, on both sides or one."""
    for side, favoured in (("Left", -style.asymmetry), ("Right", style.asymmetry)):
        smile = style.smile + ONE_SIDED_SMILE * max(0.0, favoured)
        if not smile:
            continue
        name = f"mouthSmile{side}"
        curves[name] = np.clip(curves[name] + smile, 0, 1)
        curves[f"cheekSquint{side}"] = np.full_like(curves[name], CHEEK_OF_SMILE * smile)


def _lean(curves: dict[str, FloatArray], asymmetry: float) -> None:
    """Take from the side that the style does not favour."""
    weak = "Left" if asymmetry > 0 else "Right"
    for name in curves:
        if name.startswith("mouth") and name.endswith(weak):
            curves[name] = curves[name] * (1 - ASYMMETRY_REACH * abs(asymmetry))
