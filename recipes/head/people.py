"""The named faces: eight different adults, described by traits and a few details."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from recipes.head.face import NeutralFace
from recipes.head.identity import IdentityBasis, fitted
from recipes.head.population import Traits, body


@dataclass(frozen=True)
class Person:
    name: str
    traits: Traits  # races: African, Asian, Caucasian
    details: tuple[tuple[str, float], ...] = ()  # (target, amount)


PEOPLE = (
    Person("ada", Traits(0.0, 0.52, 0.45, 0.45, (0.1, 0.0, 0.9)), (("head/head-oval", 0.3),)),
    Person("ben", Traits(1.0, 0.55, 0.60, 0.50, (0.0, 0.1, 0.9)), (("chin/chin-width-incr", 0.3),)),
    Person("chidi", Traits(1.0, 0.56, 0.60, 0.50, (1.0, 0.0, 0.0)), (("head/head-square", 0.2),)),
    Person("dana", Traits(0.05, 0.68, 0.45, 0.60, (0.2, 0.2, 0.6)), (("head/head-round", 0.3),)),
    Person("esi", Traits(0.0, 0.52, 0.45, 0.45, (1.0, 0.0, 0.0)), (("head/head-oval", 0.3),)),
    Person("feng", Traits(1.0, 0.60, 0.50, 0.48, (0.0, 1.0, 0.0)), (("head/head-square", 0.2),)),
    Person("hana", Traits(0.0, 0.51, 0.45, 0.45, (0.0, 1.0, 0.0)), (("head/head-oval", 0.2),)),
    Person("otto", Traits(1.0, 0.84, 0.45, 0.62, (0.0, 0.0, 1.0)), (("nose/nose-hump-incr", 0.3),)),
)


def coefficients(face: NeutralFace, identity: IdentityBasis) -> dict[str, np.ndarray]:
    """(component,) of each named face."""
    found = {}
    for person in PEOPLE:
        moved = body(face.mh, person.traits)
        for target, amount in person.details:
            moved += amount * face.mh.target(target)
        found[person.name] = fitted(face, identity, face.mh.base.vertices + moved)
    return found
