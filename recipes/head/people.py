"""The named faces: eight different adults, described by traits and a few details."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.head.identity import PRINCIPAL_COUNT
from recipes.head.face import SOFTENING, NeutralFace
from recipes.head.identity import IdentityBasis, fitted
from recipes.head.population import YEARS_AT_HALF, YEARS_PER_AGE, Traits, body
from recipes.head.proportions import MEASURES, Proportions


@dataclass(frozen=True)
class Person:
    name: str
    years: int
    male: float
    races: tuple[float, float, float]  # African, Asian, Caucasian
    weight: float = 0.5
    muscle: float = 0.5
    details: tuple[tuple[str, float], ...] = ()  # (target, amount)
    own: int = 0  # seed of what is nobody else's: local components, chosen by eye
    measures: tuple[tuple[str, float], ...] = ()  # (measure, mm), see `proportions`

    @property
    def traits(self) -> Traits:
        age = 0.5 + (self.years - YEARS_AT_HALF) / YEARS_PER_AGE
        return Traits(self.male, age, self.muscle, self.weight, self.races)


def _both(name: str, amount: float) -> tuple[tuple[str, float], tuple[str, float]]:
    """A target of the left side and its twin."""
    folder, _, target = name.partition("/")
    return (f"{folder}/l-{target}", amount), (f"{folder}/r-{target}", amount)


def _sized(*sizes: float) -> tuple[tuple[str, float], ...]:
    """All measures, mm, in the order of `MEASURES`."""
    return tuple(zip(MEASURES, sizes, strict=True))


PEOPLE = (
    # Heart shaped: high broad cheekbones, a narrow jaw, large eyes.
    Person(
        "ada", 29, 0.0, (0.1, 0.0, 0.9), 0.42, 0.45,
        (
            ("head/head-invertedtriangular", 0.7), *_both("cheek/cheek-bones-incr", 1.2),
            ("chin/chin-prominent-incr", 0.3), *_both("cheek/cheek-volume-decr", 0.8),
            *_both("cheek/cheek-trans-up", 0.4), ("head/head-fat-decr", 0.5),
            ("nose/nose-width2-decr", 0.4), ("nose/nose-point-up", 0.3),
            *_both("eyes/eye-corner2-up", 0.25), ("mouth/mouth-cupidsbow-incr", 0.4),
        ),
        own=1,
        measures=_sized(
            130, 106, 80, 22, 29.5, 10.0, 30.5, 29.5, 49.5,
            20.5, 43, 18.5, 40.5, 8.0, 9.5, 1.8,
        ),
    ),
    # Long and angular: a strong jaw, a straight high nose, a brow that juts.
    Person(
        "ben", 35, 1.0, (0.0, 0.1, 0.9), 0.46, 0.62,
        (
            ("head/head-rectangular", 0.4), ("chin/chin-bones-incr", 0.4),
            ("chin/chin-prominent-incr", 0.5), ("chin/chin-cleft-incr", 0.35),
            *_both("cheek/cheek-volume-decr", 0.5), ("forehead/forehead-nubian-decr", 0.25),
            ("eyebrows/eyebrows-trans-forward", 0.5), ("nose/nose-width1-decr", 0.25),
            ("nose/nose-greek-incr", 0.3), *_both("cheek/cheek-bones-incr", 0.3),
        ),
        own=2,
        measures=_sized(
            137, 116, 93, 28, 29, 9.4, 32, 33, 53,
            17, 46, 21.5, 49, 7.8, 9.8, 1.2,
        ),
    ),
    # Broad: wide cheekbones and jaw, a wide nose, full lips.
    Person(
        "chidi", 41, 1.0, (1.0, 0.0, 0.0), 0.54, 0.62,
        (
            ("head/head-square", 0.25), ("head/head-scale-vert-decr", 0.1),
            *_both("cheek/cheek-bones-incr", 0.35), ("chin/chin-bones-incr", 0.3),
            ("chin/chin-width-incr", 0.3), ("nose/nose-scale-horiz-incr", 0.25),
            ("eyebrows/eyebrows-trans-forward", 0.35), ("head/head-fat-decr", 0.3),
        ),
        own=3,
        measures=_sized(
            143, 127, 107, 33, 29.5, 9.4, 34.5, 41, 56.5,
            17.5, 45, 21, 46, 9.8, 12.5, 1.2,
        ),
    ),
    # Round, with a square jaw, full cheeks and lids that hang a little.
    Person(
        "dana", 53, 0.0, (0.2, 0.2, 0.6), 0.56, 0.42,
        (
            ("head/head-round", 0.5), ("head/head-square", 0.25),
            ("neck/neck-double-incr", 0.2), *_both("cheek/cheek-volume-incr", 0.7),
            *_both("cheek/cheek-bones-incr", 0.3), *_both("cheek/cheek-trans-up", 0.3),
            ("chin/chin-prominent-incr", 0.3), ("nose/nose-scale-depth-decr", 0.2),
            ("nose/nose-width1-decr", 0.3), *_both("eyes/eye-eyefold-down", 0.6),
        ),
        own=4,
        measures=_sized(
            134, 120, 99, 28, 28.5, 8.8, 31, 30, 50.5,
            20, 43.5, 18.5, 40.5, 7.6, 9.3, 1.8,
        ),
    ),
    # A round forehead, almond eyes far apart, full lips.
    Person(
        "esi", 23, 0.0, (1.0, 0.0, 0.0), 0.42, 0.45,
        (
            ("head/head-oval", 0.5), ("head/head-diamond", 0.2),
            ("forehead/forehead-nubian-incr", 0.4), *_both("cheek/cheek-bones-incr", 0.6),
            ("head/head-fat-decr", 0.4), *_both("cheek/cheek-volume-decr", 0.3),
            ("chin/chin-prominent-incr", 0.3), *_both("eyes/eye-corner2-up", 0.4),
        ),
        own=5,
        measures=_sized(
            132, 112, 88, 24, 29.8, 9.8, 34.5, 35.5, 51,
            20, 42.5, 19, 40.5, 9.8, 11.5, 1.8,
        ),
    ),
    # Flat and wide: broad cheekbones, narrow eyes under a low fold.
    Person(
        "feng", 61, 1.0, (0.0, 1.0, 0.0), 0.42, 0.46,
        (
            ("head/head-diamond", 0.4), ("head/head-square", 0.3),
            *_both("cheek/cheek-bones-incr", 0.9), *_both("cheek/cheek-volume-decr", 0.4),
            ("chin/chin-bones-incr", 0.3), ("chin/chin-prominent-incr", 0.3),
            ("nose/nose-scale-depth-decr", 0.2), ("head/head-fat-decr", 0.4),
            *_both("eyes/eye-eyefold-down", 0.6), *_both("eyes/eye-epicanthus-in", 0.6),
        ),
        own=6,
        measures=_sized(
            145, 124, 95, 26, 28, 8.2, 36, 36, 51.5,
            20, 45, 21.5, 43, 7.4, 9.2, 1.2,
        ),
    ),
    # A small fine oval: a short face, a low nose, a small chin.
    Person(
        "hana", 20, 0.0, (0.0, 1.0, 0.0), 0.42, 0.45,
        (
            ("head/head-oval", 0.7), ("head/head-fat-decr", 0.2),
            ("head/head-scale-depth-decr", 0.2), ("chin/chin-triangle", 0.2),
            ("chin/chin-prominent-incr", 0.2), *_both("cheek/cheek-bones-incr", 0.4),
            *_both("cheek/cheek-volume-incr", 0.2), ("nose/nose-point-width-decr", 0.3),
            *_both("eyes/eye-corner2-up", 0.3), *_both("eyes/eye-epicanthus-in", 0.4),
        ),
        own=7,
        measures=_sized(
            126, 107, 83, 21, 27.8, 9.2, 33, 29.5, 46.5,
            20.5, 41, 17.5, 37, 8.0, 9.2, 2.0,
        ),
    ),
    # Bony: a long humped nose, a heavy brow, hollow cheeks and temples.
    Person(
        "otto", 74, 1.0, (0.0, 0.0, 1.0), 0.60, 0.42,
        (
            ("nose/nose-hump-incr", 0.6), ("nose/nose-scale-vert-incr", 0.3),
            ("neck/neck-double-incr", 0.35), *_both("cheek/cheek-volume-decr", 1.5),
            *_both("cheek/cheek-bones-incr", 0.8), ("mouth/mouth-laugh-lines-in", 0.4),
            ("eyebrows/eyebrows-trans-forward", 0.6), *_both("eyes/eye-bag-incr", 0.4),
            ("forehead/forehead-temple-decr", 0.4), ("chin/chin-prominent-incr", 0.3),
        ),
        own=8,
        measures=_sized(
            138, 112, 92, 28, 28, 8.4, 33, 36, 54,
            17, 48.5, 21, 43.5, 5.8, 8.5, 0.8,
        ),
    ),
)  # fmt: skip
"""Four women and four men, of 20 to 74 years."""
FRIENDLY = 1.0
"""Share of the mean face's friendly touches in theirs."""
OWN, OWN_LEAN = 0.3, 0.9
"""Standard deviation of their local components: no face is its own mirror image."""


def coefficients(face: NeutralFace, identity: IdentityBasis) -> dict[str, np.ndarray]:
    """(component,) of each named face."""
    found, proportions = {}, Proportions(face, identity)
    for person in PEOPLE:
        moved = body(face.mh, person.traits)
        softening = [(target, FRIENDLY * amount) for target, amount in SOFTENING]
        for target, amount in (*person.details, *softening):
            moved += amount * face.mh.target(target)
        values = fitted(face, identity, face.mh.base.vertices + moved)
        drawn = np.random.default_rng(person.own).normal(size=len(values) - PRINCIPAL_COUNT)
        values[PRINCIPAL_COUNT:] += _own_share(face, identity) * np.clip(drawn, -2, 2)
        found[person.name] = proportions.brought(values, dict(person.measures))
    return found


def _own_share(face: NeutralFace, identity: IdentityBasis) -> np.ndarray:
    """(local component,) OWN_LEAN of those that set left against right, OWN of the others."""
    local = identity.vertices[PRINCIPAL_COUNT:]
    alike = np.einsum("kvx,kvx->k", local, face.mirrored(local))
    return np.where(alike < 0, OWN_LEAN, OWN)
