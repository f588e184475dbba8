"""What faces do in pauses: swallowing, and breathing in before they go on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float64Array, FloatArray
from elocute.numerics.smoothing import smoothstep
from recipes.rich_faces.face_places import FacePlaces

SWALLOW_S = 0.75
SWALLOW_PAUSE_S = 0.6  # shorter pauses are too short for it
BREATH_S = 0.38
BREATH_PAUSE_S = 0.22
BREATH_EVERY_S = 2.6  # nobody breathes in at every pause
SILENT = 0.5
PRESSED = {
    "mouthPressLeft": 0.22,
    "mouthPressRight": 0.22,
    "mouthShrugLower": 0.12,
    "mouthRollLower": 0.08,
}


@dataclass(frozen=True)
class PauseHabits:
    """swallow: share of the long pauses; the others are amounts, 1 in a typical person."""

    swallow: float
    swallowing: float
    breathing: float
    tide_hertz: float


def draw_pause_habits(swallowing: float, breathing: float, seed: int) -> PauseHabits:
    rng = np.random.default_rng((seed, 30))
    amount = np.exp(0.3 * rng.normal(size=2))
    return PauseHabits(
        float(rng.uniform(0.25, 0.7)),
        float(swallowing * amount[0]),
        float(breathing * amount[1]),
        float(rng.uniform(0.2, 0.3)),
    )


def pause_fields(places: FacePlaces, normals: FloatArray) -> Float64Array:
    """(5, vertex, 3) m: hyoid, larynx low and high; nostrils; throat and collar.

    The first three are weighed by `swallow_weights`, the other two by `breath_weights`.
    """
    soft = places.soft[:, None]
    up, forward = np.array([0, 1.0, 0]), np.array([0, 0, 1.0])
    hyoid = places.bell(0, -107, 42, 13)[:, None] * (0.0030 * up + 0.0012 * forward)
    low = 0.0022 * places.bell(0, -146, 26, 8)[:, None] * normals
    high = 0.0026 * places.bell(0, -130, 30, 8)[:, None] * normals
    wings = [
        places.bell(side * 13.5, -43, 87, 5.5)[:, None] * np.array([side * 0.0009, 0.0001, 0.0002])
        for side in (1, -1)
    ]
    collar = -0.0016 * sum(
        places.bell(side * 38, -150, 8, 15)[:, None] * normals for side in (1, -1)
    )
    throat = -0.0012 * places.bell(0, -112, 40, 18)[:, None] * up
    return np.stack(
        [hyoid * soft, low * soft, high * soft, sum(wings) * soft, (collar + throat) * soft]
    )


def pauses(silence: Float64Array, rate: float) -> list[tuple[float, float]]:
    """Start and end in s of every stretch that is silent, from the posterior of silence (row,)."""
    quiet = np.concatenate([[0], (silence > SILENT).astype(int), [0]])
    starts, ends = np.flatnonzero(np.diff(quiet) > 0), np.flatnonzero(np.diff(quiet) < 0)
    return [(a / rate, b / rate) for a, b in zip(starts, ends, strict=True)]


def swallow_weights(
    habits: PauseHabits,
    stretches: list[tuple[float, float]],
    times: Float64Array,
    rng: np.random.Generator,
) -> tuple[Float64Array, Float64Array]:
    """Weights (frame, 3) of the fields, and how far the lips are pressed (frame,)."""
    out, pressed = np.zeros((len(times), 3)), np.zeros(len(times))
    for start, end in stretches:
        chance, place = rng.random(2)
        if end - start < SWALLOW_PAUSE_S or chance > habits.swallow or not habits.swallowing:
            continue
        length = min(SWALLOW_S, end - start)
        at = (times - start - place * (end - start - length)) / length
        inside = (at > 0) & (at < 1)
        whole = np.where(inside, smoothstep(np.clip(np.minimum(at, 1 - at) / 0.4, 0, 1)), 0)
        late = np.where(inside, np.exp(-0.5 * ((at - 0.55) / 0.14) ** 2) * whole, 0)
        out += habits.swallowing * np.stack([whole, -0.8 * late, late], axis=1)
        pressed = np.maximum(pressed, min(habits.swallowing, 1.5) * whole)
    return out, pressed


def breath_weights(
    habits: PauseHabits,
    stretches: list[tuple[float, float]],
    times: Float64Array,
    rng: np.random.Generator,
) -> Float64Array:
    """(frame, 2): nostrils, then throat and collar: breaths in pauses over a slow tide."""
    tide = np.sin(2 * np.pi * (habits.tide_hertz * times + rng.random()))
    gasp, last = np.zeros(len(times)), -BREATH_EVERY_S
    for start, end in stretches:
        if end - start < BREATH_PAUSE_S or end - last < BREATH_EVERY_S:
            continue
        at = (times - (end - BREATH_S)) / (BREATH_S + 0.15)
        gasp += np.where((at > 0) & (at < 1), np.sin(np.pi * np.clip(at, 0, 1)) ** 2, 0)
        last = end
    return habits.breathing * np.stack([gasp + 0.06 * tide, gasp + 0.12 * tide], axis=1)
