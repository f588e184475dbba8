"""Head and brow with the stress of the speech: small, a little late, and not at every accent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float64Array
from elocute.audio.waveform import Waveform
from elocute.numerics.smoothing import gaussian_smoothed

STEP_S = 0.01
LOUD_S, AROUND_S = 0.08, 0.6
ACCENT_LATE_S = 0.06
BROWS = ("browInnerUp", "browOuterUpLeft", "browOuterUpRight", "browDownLeft", "browDownRight")


@dataclass(frozen=True)
class Gestures:
    """How much of it a person does.

    nod, wander in radians; brow, frown as weights; share of the accents that brows go with.
    """

    nod: float
    wander: float
    brow: float
    frown: float
    share: float


def draw_gestures(strength: float, seed: int) -> Gestures:
    rng = np.random.default_rng((seed, 20))
    amount = strength * np.exp(0.5 * rng.normal(size=4))
    return Gestures(
        float(np.radians(1.6) * amount[0]),
        float(np.radians(1.2) * amount[1]),
        float(0.22 * amount[2]),
        float(0.10 * amount[3]),
        float(rng.uniform(0.3, 0.8)),
    )


def accents(
    sound: Waveform | None, voiced: Float64Array, rate: float, times: Float64Array
) -> Float64Array:
    """(frame,) about 0 to 1: how far the speech stands out of its surroundings.

    voiced (row,) at `rate` is the probability of a vowel; it alone counts without a sound.
    """
    rows = np.arange(len(voiced)) / rate
    if sound is None or not len(sound.samples):
        loud = gaussian_smoothed(voiced, max(LOUD_S * rate, 1.0))
    else:
        step = max(1, round(STEP_S * sound.sample_rate))
        count = -(-len(sound.samples) // step)
        padded = np.zeros(count * step)
        padded[: len(sound.samples)] = sound.samples
        level = np.sqrt((padded.reshape(count, step) ** 2).mean(axis=1))
        at = np.arange(count) * step / sound.sample_rate
        scale = max(float(np.percentile(level, 95)), 1e-6)
        level = gaussian_smoothed(np.minimum(level / scale, 1.5), LOUD_S / STEP_S)
        loud = np.interp(rows, at, level) * np.minimum(
            1, 2 * gaussian_smoothed(voiced, 0.04 * rate + 0.5)
        )
    stand = loud - gaussian_smoothed(loud, AROUND_S * rate)
    return np.interp(times - ACCENT_LATE_S, rows, np.clip(2.5 * stand, 0, 1))


def brow_weights(
    gestures: Gestures, accent: Float64Array, fps: float, rng: np.random.Generator
) -> dict[str, Float64Array]:
    """Weights (frame,) of the shapes of the brow."""
    peaks = np.repeat(
        rng.random(len(accent) // max(1, round(0.5 * fps)) + 1), max(1, round(0.5 * fps))
    )
    chosen = gaussian_smoothed((peaks[: len(accent)] < gestures.share) * accent, 0.07 * fps)
    frowned = gaussian_smoothed((peaks[: len(accent)] > 1 - gestures.share / 3) * accent, 0.1 * fps)
    side = rng.uniform(0.7, 1.3, size=4)
    return {
        "browInnerUp": gestures.brow * chosen,
        "browOuterUpLeft": 0.7 * side[0] * gestures.brow * chosen,
        "browOuterUpRight": 0.7 * side[1] * gestures.brow * chosen,
        "browDownLeft": side[2] * gestures.frown * frowned,
        "browDownRight": side[3] * gestures.frown * frowned,
    }


def head_turns(
    gestures: Gestures, accent: Float64Array, fps: float, rng: np.random.Generator
) -> Float64Array:
    """(frame, 3) radians about x, y and z: a nod on accents, and a slow wandering."""
    times = np.arange(len(accent)) / fps
    wander = np.zeros((len(accent), 3))
    for hertz, share in ((0.13, 1.0), (0.31, 0.6), (0.7, 0.25)):
        phase = rng.uniform(0, 2 * np.pi, size=3)
        pace = hertz * rng.uniform(0.8, 1.25, size=3)
        wander += share * np.sin(2 * np.pi * pace * times[:, None] + phase)
    wander = (wander - wander[0]) * [0.5, 1.0, 0.6]
    nod = gaussian_smoothed(accent, 0.08 * fps)
    return gestures.wander * wander + gestures.nod * np.stack(
        [nod, 0.15 * nod * np.sign(rng.normal()), 0.2 * nod * np.sign(rng.normal())], axis=1
    )
