"""Solves for curves that give the mouth that was heard: six measures, contacts, rest and breath."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float32Array, Float64Array, FloatArray
from elocute.articulation.driver import BITTEN_MOST, PARTING
from elocute.articulation.phone_targets import curve_names
from elocute.articulation.style import Style
from elocute.head.viseme_shapes import LABIODENTAL
from elocute.motion.mouth_measures import TRACKED_MEASURES
from elocute.motion.mouth_response import (
    MouthResponse,
    Seal,
    builtin_response,
    corrected_curves,
)

OPENING, WIDTH, PROTRUSION, JAW, UPPER, LOWER = range(len(TRACKED_MEASURES))
EASE_MM = 0.5  # above their least opening, in which lips slow down
FREEDOM = {
    "jawOpen": 0.25,
    "mouthClose": 0.25,
    "mouthLowerDownLeft": 0.25,
    "mouthLowerDownRight": 0.25,
    "mouthUpperUpLeft": 0.22,
    "mouthUpperUpRight": 0.22,
    "mouthPucker": 0.3,
    "mouthFunnel": 0.3,
    "mouthStretchLeft": 0.35,
    "mouthStretchRight": 0.35,
    "mouthSmileLeft": 0.04,
    "mouthSmileRight": 0.04,
}
TOLERANCE_MM = {
    "opening_mm": 0.08,
    "width_mm": 0.5,
    "protrusion_mm": 0.15,
    "jaw_mm": 0.4,
    "upper_lip_mm": 0.3,
    "lower_lip_mm": 0.6,
}
COVERED_MM = 0.9  # that the upper lip stays lower than people's: it bares this head's teeth sooner
BITTEN_MM = 1.2  # gap of the lips in f and v
ROUNDED = ("mouthPucker", "mouthFunnel")


@dataclass(frozen=True, eq=False)
class AskedMouth:
    """What is asked of the mouth, row by row.

    Parameters
    ----------
    wanted_mm : (row, measure) float64
        Of speech.
    rounding : (row,) float64
        How far the width is that of the rules.
    parted_mm : (row,) float64
        How near lips may come without a contact.
    stiff : (row,) float32
        Share of its freedom that the jaw loses.
    breath_mm : (row,) float64
        How far lips part at least, to breathe in.
    rest, settled, sealed, at_teeth : (row,)
        0 to 1: lips at rest, all else at rest, lips shut, lower lip at the teeth.
    """

    wanted_mm: Float64Array
    rounding: Float64Array
    parted_mm: Float64Array
    stiff: Float32Array
    breath_mm: Float64Array
    rest: Float64Array
    settled: Float64Array
    sealed: Float32Array
    at_teeth: Float32Array


def mouth_curves(
    rules: Float32Array, asked: AskedMouth, style: Style, strength: float
) -> Float32Array:
    """Curves of the built-in head that measure what is asked, with a strength from 0 to 2.

    The least change of what the rules say, (row, curve) in the order of `curve_names`, with
    contacts among the conditions: where lips meet, jaw, width and the rest of the mouth still are
    as they were heard.

    Returns
    -------
    (row, curve) float32
        0 to 1.
    """
    names = curve_names()
    response = builtin_response(names)
    rest, sealed, at_teeth = asked.rest, asked.sealed, asked.at_teeth
    base = rules * ((1 - rest) * strength)[:, None].astype(np.float32)
    for name in ROUNDED:
        base[:, names.index(name)] *= style.rounding
    apart = (1 - sealed) * (1 - at_teeth)
    for name in PARTING:
        if name in names:
            base[:, names.index(name)] *= apart
    bitten = names.index("mouthLabiodental")
    base[:, bitten] = np.maximum(base[:, bitten], at_teeth) * (1 - sealed)
    freedom = _freedom(asked, style, apart)
    seal = Seal(np.maximum(sealed, at_teeth), -LABIODENTAL["jawOpen"] * at_teeth * (1 - sealed))
    wanted = _wanted(rules, asked, response, style, strength)
    opening = response.rest[OPENING]
    wanted[:, OPENING] += sealed * (opening - wanted[:, OPENING])
    most = np.array([BITTEN_MOST.get(name, 0.0) for name in names]) @ response.effects
    jaw, narrow = response.rest[[JAW, WIDTH]] + most[[JAW, WIDTH]]
    wanted[:, JAW] -= at_teeth * np.maximum(wanted[:, JAW] - jaw, 0)
    wanted[:, WIDTH] += at_teeth * np.maximum(narrow - wanted[:, WIDTH], 0)
    # A lip that is rolled in stands back and is short: nothing else makes up for that.
    rolled = [PROTRUSION, UPPER, LOWER]
    wanted[:, rolled] += at_teeth[:, None] * response.effects[bitten, rolled]
    wanted[:, OPENING] += at_teeth * (1 - sealed) * (BITTEN_MM - wanted[:, OPENING])
    return corrected_curves(response, np.clip(base, 0, 1), wanted, freedom, TOLERANCE_MM, seal)


def _freedom(asked: AskedMouth, style: Style, apart: FloatArray) -> dict[str, float | FloatArray]:
    """How far each curve may well be moved in each row."""
    freedom: dict[str, float | FloatArray] = dict(FREEDOM)
    for name in FREEDOM:
        if name.startswith("mouthUpperUp"):
            freedom[name] = FREEDOM[name] * style.upper_lip
    freedom["jawOpen"] = FREEDOM["jawOpen"] * (1 - asked.stiff)
    return freedom | {name: freedom[name] * apart for name in PARTING if name in freedom}


def _wanted(
    rules: Float32Array, asked: AskedMouth, response: MouthResponse, style: Style, strength: float
) -> Float64Array:
    """(row, measure) mm of the mouth without contacts."""
    rest = asked.rest
    speech = 1 - rest
    moved = asked.wanted_mm - response.rest
    moved[:, UPPER] += COVERED_MM
    gains = np.full(len(TRACKED_MEASURES), style.amplitude)
    gains[[WIDTH, PROTRUSION]] = style.spread, style.rounding
    gains[UPPER] *= style.upper_lip
    moved[:, WIDTH] += asked.rounding * (rules @ response.effects[:, WIDTH] - moved[:, WIDTH])
    # Towards the least they slow down, so that near closures differ from each other.
    least = (asked.parted_mm - response.rest[OPENING]) * min(1.0, strength)
    above = (gains[OPENING] * strength * moved[:, OPENING] - least) / EASE_MM
    lips_mm = least + EASE_MM * np.logaddexp(0.0, above)
    kept = (1 - asked.settled) * strength
    wanted: Float64Array = response.rest + kept[:, None] * gains * moved
    resting_mm = strength * style.parted_mm
    if resting_mm:
        resting_mm -= response.rest[OPENING]
    wanted[:, OPENING] = response.rest[OPENING] + speech * lips_mm + rest * resting_mm
    inhaling_mm = gains[OPENING] * strength * asked.breath_mm
    wanted[:, OPENING] = np.maximum(wanted[:, OPENING], response.rest[OPENING] + inhaling_mm)
    return wanted
