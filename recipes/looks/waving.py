"""Waves of long hair: what hangs is led aside and back, locks together, after it is combed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from recipes.looks.cards import Cards
from recipes.looks.scalp import Places, Scalp, ramp

WAVE_MM, SHORTER = 112.0, 0.20
"""From crest to crest, and how much shorter waves are at the tips."""
FROM_MM = (10.0, -120.0)
"""Heights over the eyes between which waves grow: near its root hair lies flat."""
ASIDE_MM, OUT_MM = 10.0, 7.0
"""How far hair goes to either side, and off the head, never towards it."""
INWARD_MM, FACE_MM = 0.5, (-105.0, -75.0)
"""How far waves lead hair over the face at most, and between which distances behind the tip of the
nose that begins."""
LOCK_MM, APART = 34.0, 1.5
"""How wide locks are that wave together, and how far their waves are apart, radians."""
AXIS_MM = -120.0
"""Waves go round a line so far behind the tip of the nose."""


def waved(scalp: Scalp, cards: Cards) -> Cards:
    """The same cards, hair below the temples in waves."""
    places = scalp.places(cards.points)
    moved = _waves(places) / 1000
    return replace(cards, points=cards.points + moved, offset=cards.offset + moved)


def _waves(places: Places) -> np.ndarray:
    """(n, 3) mm by which hair there is led aside."""
    height = places[:, 1]
    radial = places * [1.0, 0, 1.0] - [0, 0, AXIS_MM]
    radial = radial / np.maximum(np.linalg.norm(radial, axis=1, keepdims=True), 1e-6)
    aside = np.cross(radial, [0, 1.0, 0])
    share = ramp(height, *FROM_MM)[:, None]
    down = np.maximum(FROM_MM[0] - height, 0)
    turns = down / WAVE_MM * (1 + SHORTER * down / 300)
    phase = 2 * np.pi * turns + APART * _locks(places)
    out = OUT_MM * (1 - np.cos(phase + 0.9)) / 2
    moved = share * (ASIDE_MM * np.sin(phase)[:, None] * aside + out[:, None] * radial)
    side, before = np.sign(places[:, 0]), ramp(places[:, 2], *FACE_MM)
    moved[:, 0] += side * before * np.maximum(-side * moved[:, 0] - INWARD_MM, 0)
    return moved


def _locks(places: Places) -> np.ndarray:
    """(n,) about -1..1, alike among neighbours, hardly changing from root to tip."""
    rng = np.random.default_rng(41)
    ways = rng.normal(size=(3, 8)) / LOCK_MM * [[1.0], [0.15], [1.0]]
    return np.sin(places @ ways + rng.uniform(0, 2 * np.pi, 8)).mean(1) * 2
