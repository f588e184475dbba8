"""The named faces: eight different adults, described by traits and a few details."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.head.identity import PRINCIPAL_COUNT
from recipes.head.face import SOFTENING, NeutralFace
from recipes.head.identity import IdentityBasis, fitted
from recipes.head.population import YEARS_AT_HALF, YEARS_PER_AGE, Traits, body


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

    @property
    def traits(self) -> Traits:
        age = 0.5 + (self.years - YEARS_AT_HALF) / YEARS_PER_AGE
        return Traits(self.male, age, self.muscle, self.weight, self.races)


def _both(name: str, amount: float) -> tuple[tuple[str, float], tuple[str, float]]:
    """A target of the left side and its twin."""
    folder, _, target = name.partition("/")
    return (f"{folder}/l-{target}", amount), (f"{folder}/r-{target}", amount)


PEOPLE = (
    Person(
        "ada", 29, 0.0, (0.1, 0.0, 0.9), 0.45, 0.45,
        (("head/head-oval", 0.35), *_both("cheek/cheek-bones-incr", 0.35)),
        own=1,
    ),
    Person(
        "ben", 35, 1.0, (0.0, 0.1, 0.9), 0.50, 0.60,
        (("chin/chin-width-incr", 0.3), ("head/head-rectangular", 0.2)),
        own=2,
    ),
    Person(
        "chidi", 41, 1.0, (1.0, 0.0, 0.0), 0.52, 0.60,
        (("head/head-square", 0.2), ("mouth/mouth-lowerlip-height-decr", 0.5)),
        own=3,
    ),
    Person(
        "dana", 53, 0.05, (0.2, 0.2, 0.6), 0.64, 0.45,
        (("head/head-round", 0.35), ("neck/neck-double-incr", 0.3)),
        own=4,
    ),
    Person(
        "esi", 23, 0.0, (1.0, 0.0, 0.0), 0.45, 0.45,
        (("head/head-oval", 0.35), *_both("cheek/cheek-bones-incr", 0.3)),
        own=5,
    ),
    Person(
        "feng", 61, 1.0, (0.0, 1.0, 0.0), 0.46, 0.46,
        (
            ("head/head-square", 0.2), ("mouth/mouth-angles-up", 0.15),
            *_both("cheek/cheek-bones-incr", 0.3),
        ),
        own=6,
    ),
    Person(
        "hana", 20, 0.0, (0.0, 1.0, 0.0), 0.45, 0.45,
        (("head/head-oval", 0.2), *_both("cheek/cheek-volume-incr", 0.2)),
        own=7,
    ),
    Person(
        "otto", 74, 1.0, (0.0, 0.0, 1.0), 0.60, 0.42,
        (
            ("nose/nose-hump-incr", 0.35), ("neck/neck-double-incr", 0.4),
            ("mouth/mouth-angles-up", 0.25),
        ),
        own=8,
    ),
)  # fmt: skip
"""Four women and four men, of 20 to 74 years."""
FRIENDLY = 1.0
"""Share of the mean face's friendly touches in theirs."""
OWN, OWN_LEAN = 0.3, 0.9
"""Standard deviation of their local components: no face is its own mirror image."""


def coefficients(face: NeutralFace, identity: IdentityBasis) -> dict[str, np.ndarray]:
    """(component,) of each named face."""
    found = {}
    for person in PEOPLE:
        moved = body(face.mh, person.traits)
        softening = [(target, FRIENDLY * amount) for target, amount in SOFTENING]
        for target, amount in (*person.details, *softening):
            moved += amount * face.mh.target(target)
        values = fitted(face, identity, face.mh.base.vertices + moved)
        drawn = np.random.default_rng(person.own).normal(size=len(values) - PRINCIPAL_COUNT)
        values[PRINCIPAL_COUNT:] += _own_share(face, identity) * np.clip(drawn, -2, 2)
        found[person.name] = values
    return found


def _own_share(face: NeutralFace, identity: IdentityBasis) -> np.ndarray:
    """(local component,) OWN_LEAN of those that set left against right, OWN of the others."""
    local = identity.vertices[PRINCIPAL_COUNT:]
    alike = np.einsum("kvx,kvx->k", local, face.mirrored(local))
    return np.where(alike < 0, OWN_LEAN, OWN)
