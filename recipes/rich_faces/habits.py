"""How a person says each phone: how far, with what besides, when, and never twice alike."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array, FloatArray
from elocute.articulation.driver import articulate, make_contacts
from elocute.articulation.phone_targets import curve_names
from elocute.articulation.style import Style
from elocute.encoders.phones_and_visemes import BILABIALS, LABIODENTALS, PHONES, SILENCE
from elocute.motion.curves import Curves
from elocute.numerics.resampling import interpolate
from elocute.numerics.smoothing import gaussian_smoothed
from recipes.rich_faces import talker_spread

# What is drawn so that measured mouths spread as those of real talkers do: limits and contacts take
# a part away.
JAW_SPREAD = 1.6 * talker_spread.JAW
LIP_SPREAD = talker_spread.LIPS
ROUNDED = 0.55
PARTING = ("mouthLowerDownLeft", "mouthLowerDownRight", "mouthUpperUpLeft", "mouthUpperUpRight")
TARGET_SPREAD = 0.25  # of the logarithm of a shape's weight in a phone
LEAD_S = 0.014  # standard deviation of how much earlier a person makes a phone
CONTACT_LEAD_S = 0.005
ALIKE = 0.10  # standard deviation of the logarithm from one time to the next
ALIKE_S = 0.12
MOOD_S = 0.45
SEEN_S = 0.035  # a phone's habits come and go so
BESIDES = 3  # shapes that a person adds to a phone
# Nobody opens further in speech, whatever adds up.
WIDEST = {
    "jawOpen": 0.52,
    "mouthLowerDownLeft": 0.35,
    "mouthLowerDownRight": 0.35,
    "mouthUpperUpLeft": 0.25,
    "mouthUpperUpRight": 0.25,
    "mouthPucker": 0.85,
    "mouthFunnel": 0.6,
}
# What people do besides, and how far at most.
SECONDARY: dict[str, float] = {
    "mouthRollLower": 0.208,
    "mouthRollUpper": 0.182,
    "mouthShrugLower": 0.234,
    "mouthShrugUpper": 0.182,
    "mouthDimpleLeft": 0.234,
    "mouthDimpleRight": 0.234,
    "mouthFrownLeft": 0.182,
    "mouthFrownRight": 0.182,
    "mouthSmileLeft": 0.182,
    "mouthSmileRight": 0.182,
    "mouthLeft": 0.104,
    "mouthRight": 0.104,
    "mouthPressLeft": 0.182,
    "mouthPressRight": 0.182,
    "cheekSquintLeft": 0.156,
    "cheekSquintRight": 0.156,
    "noseSneerLeft": 0.13,
    "noseSneerRight": 0.13,
    "jawLeft": 0.13,
    "jawRight": 0.13,
    "mouthPucker": 0.13,
    "mouthFunnel": 0.13,
}
# What comes and goes with the mood, as a standard deviation over `MOOD_S`.
MOOD: dict[str, float] = {
    "mouthSmileLeft": 0.084,
    "mouthSmileRight": 0.084,
    "mouthFrownLeft": 0.07,
    "mouthFrownRight": 0.07,
    "mouthDimpleLeft": 0.084,
    "mouthDimpleRight": 0.084,
    "mouthLeft": 0.042,
    "mouthRight": 0.042,
    "mouthRollLower": 0.056,
    "mouthRollUpper": 0.056,
    "mouthShrugLower": 0.07,
    "mouthShrugUpper": 0.07,
    "mouthUpperUpLeft": 0.056,
    "mouthUpperUpRight": 0.056,
    "cheekSquintLeft": 0.084,
    "cheekSquintRight": 0.084,
    "noseSneerLeft": 0.056,
    "noseSneerRight": 0.056,
    "jawLeft": 0.042,
    "jawRight": 0.042,
    "jawForward": 0.07,
}
# What everybody does a little, and each to another extent.
COMMON: tuple[tuple[str, tuple[str, ...], float], ...] = (
    ("jawForward", ("S", "Z", "SH", "ZH", "CH", "JH"), 0.22),
    ("cheekPuff", ("P", "B"), 0.10),
    ("mouthShrugLower", ("CH", "JH", "SH", "M"), 0.14),
    ("mouthRollLower", ("F", "V", "P", "B", "M"), 0.12),
    ("mouthRollUpper", ("M",), 0.10),
)
# An articulatory setting: how a mouth is held throughout speech.
SETTINGS: dict[str, float] = {
    "mouthSmileLeft": 0.05,
    "mouthSmileRight": 0.05,
    "mouthFrownLeft": 0.05,
    "mouthFrownRight": 0.05,
    "mouthPucker": 0.05,
    "mouthStretchLeft": 0.05,
    "mouthStretchRight": 0.05,
    "mouthShrugUpper": 0.04,
    "jawForward": 0.06,
}


@dataclass(frozen=True, eq=False)
class Habits:
    """Of one person.

    Attributes
    ----------
    style
        How the driver articulates for the person.
    gains
        (phone, curve) factors.
    added
        (phone, curve) weights.
    held
        (curve,) weights throughout speech.
    leads_s
        (phone,) how much earlier than others.
    varied
        Standard deviation of the logarithm of amounts from one time to the next.
    moods
        (curve,) standard deviations of weights that come and go.
    """

    style: Style
    gains: Float64Array
    added: Float64Array
    held: Float64Array
    leads_s: Float64Array
    varied: float
    moods: Float64Array


def habit_names() -> tuple[str, ...]:
    """The driver's curves, then those that only habits move."""
    besides = dict.fromkeys([*SECONDARY, *MOOD, *(name for name, _, _ in COMMON), *SETTINGS])
    return tuple(dict.fromkeys([*curve_names(), *besides]))


def draw_habits(style: Style, strength: float, seed: int) -> Habits:
    """A person's habits about a style; strength 0 leaves the style as it is."""
    rng = np.random.default_rng((seed, 10))
    names = habit_names()
    place = {name: index for index, name in enumerate(names)}
    shape = (len(PHONES), len(names))
    gains = np.exp(strength * TARGET_SPREAD * _paired(rng.normal(size=shape), names))
    gains[:, [place[name] for name in PARTING]] *= np.exp(strength * LIP_SPREAD * rng.normal())
    added = np.zeros(shape)
    extent = np.array(list(SECONDARY.values()))
    for phone in range(len(PHONES)):
        for which in rng.choice(len(SECONDARY), BESIDES, replace=False):
            name = list(SECONDARY)[which]
            amount = strength * extent[which] * rng.uniform(0.2, 1.0)
            added[phone, place[name]] += amount
            other = _other_side(name)
            if other in place:
                added[phone, place[other]] += amount * rng.uniform(0.3, 1.0)
    for name, phones, most in COMMON:
        amount = strength * most * rng.uniform(0.1, 1.0)
        for phone in phones:
            added[PHONES.index(phone), place[name]] += amount * rng.uniform(0.7, 1.3)
    added[SILENCE] = 0
    held = np.zeros(len(names))
    for name, most in SETTINGS.items():
        held[place[name]] = strength * max(0.0, most * rng.normal())
    moods = np.zeros(len(names))
    for name, most in MOOD.items():
        moods[place[name]] = strength * most * np.exp(0.4 * rng.normal())
    leads = rng.normal(size=len(PHONES)) * LEAD_S
    for phone in (*BILABIALS, *LABIODENTALS):
        leads[PHONES.index(phone)] *= CONTACT_LEAD_S / LEAD_S
    leads[SILENCE] = 0
    return Habits(
        _own_style(style, strength, rng),
        gains,
        added,
        held,
        strength * leads,
        strength * ALIKE,
        moods,
    )


def speak(
    habits: Habits,
    log_posteriors: FloatArray,
    rate: float,
    frame_count: int,
    fps: float,
    rng: np.random.Generator,
) -> Curves:
    """Curves of `habit_names` for phones, as this person says them this time.

    Contacts come last, as in the driver, so p, b and m close whatever the habits are.
    """
    posteriors = _led(np.exp(log_posteriors), rate, habits.leads_s)
    moved = np.log(np.maximum(posteriors, 1e-6)).astype(np.float32)
    plain = articulate(moved, rate, frame_count=frame_count, fps=fps, style=habits.style)
    names = habit_names()
    values = plain.select(names).values.astype(np.float64)
    times = np.arange(frame_count) / fps
    smooth = gaussian_smoothed(posteriors, SEEN_S * rate)
    heard = interpolate(np.arange(len(smooth)) / rate, smooth, times)
    once = np.exp(habits.varied * _slow_noise(rng, frame_count, fps, len(names), ALIKE_S))
    mood = np.maximum(_slow_noise(rng, frame_count, fps, len(names), MOOD_S), 0)
    values = values * np.exp(heard @ np.log(habits.gains))
    values += heard @ habits.added + (1 - heard[:, [SILENCE]]) * habits.held
    values = np.clip(values * once + mood * habits.moods, 0, 1)
    for name, most in WIDEST.items():
        values[:, names.index(name)] = _limited(values[:, names.index(name)], most)
    curves = Curves(values.astype(np.float32), names, fps)
    return make_contacts(curves, moved, rate, habits.style)


def _limited(values: Float64Array, most: float) -> Float64Array:
    """The same up to two thirds of a limit, then ever slower towards it."""
    knee = most * 2 / 3
    over = np.maximum(values - knee, 0)
    return np.minimum(values, knee) + over / (1 + over / (most - knee))


def _own_style(style: Style, strength: float, rng: np.random.Generator) -> Style:
    def about(value: float, spread: float, low: float, high: float) -> float:
        return float(np.clip(value * np.exp(strength * spread * rng.normal()), low, high))

    # The driver's lips round and spread further than tracked ones do.
    narrow = 1 - min(strength, 1.0) * (1 - ROUNDED)
    return replace(
        style,
        amplitude=about(style.amplitude, JAW_SPREAD, 0.3, 2.0),
        rounding=about(narrow * style.rounding, talker_spread.WIDTH, 0.2, 1.2),
        spread=about(narrow * style.spread, talker_spread.WIDTH, 0.2, 1.5),
        upper_lip=about(style.upper_lip, 0.3, 0.2, 2.0),
        asymmetry=float(np.clip(style.asymmetry + strength * 0.15 * rng.normal(), -1, 1)),
        anticipation_s=about(style.anticipation_s, 0.15, 0.02, 0.12),
        carry_s=about(style.carry_s, 0.15, 0.02, 0.12),
    )


def _paired(draws: Float64Array, names: tuple[str, ...]) -> Float64Array:
    """Draws (phone, curve) whose right sides are mostly those of the left."""
    place = {name: index for index, name in enumerate(names)}
    for name, index in place.items():
        if name.endswith("Right") and _other_side(name) in place:
            draws[:, index] = 0.9 * draws[:, place[_other_side(name)]] + 0.44 * draws[:, index]
    return draws


def _other_side(name: str) -> str:
    if name in ("mouthLeft", "mouthRight", "jawLeft", "jawRight"):
        return ""  # a movement to a side has none
    if name.endswith("Left"):
        return f"{name[:-4]}Right"
    return f"{name[:-5]}Left" if name.endswith("Right") else ""


def _led(posteriors: FloatArray, rate: float, leads_s: Float64Array) -> Float64Array:
    """Posteriors (row, phone) with each phone moved to its own earlier time; rows sum to one."""
    times = np.arange(len(posteriors)) / rate
    moved = np.stack(
        [
            np.interp(times + lead, times, column)
            for lead, column in zip(leads_s, posteriors.T, strict=True)
        ],
        axis=1,
    )
    moved = np.maximum(moved, 1e-6)
    return moved / moved.sum(axis=1, keepdims=True)


def _slow_noise(
    rng: np.random.Generator, frames: int, fps: float, channels: int, step: float
) -> NDArray[np.float64]:
    """(frame, channel) of unit variance that changes over `step` seconds."""
    count = int(np.ceil(frames / fps / step)) + 8
    coarse = gaussian_smoothed(rng.normal(size=(count, channels)), 1.0)
    coarse /= 0.531  # what smoothing leaves of the standard deviation
    return interpolate(np.arange(count) * step - 3 * step, coarse, np.arange(frames) / fps)
