"""A person's own version of each shape: another pattern, another amount, another path.

A shape B of the rig becomes (1 + gain)·(I + N)·B + |B|·n: N a smooth field of 3 by 3 matrices,
n a smooth field of directions. Part of a field is everybody's, as no rig is the mean of people; of
the rest a part is in all shapes of a person, the other the shape's own. Faces are nearly
symmetric: the right smile is mostly the mirror image of the left one. Shapes that come together,
and one shape far out, move the skin in ways of their own: fields weighed by the product of two
weights.
"""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float64Array
from elocute.head.model import HeadModel
from recipes.rich_faces.face_places import FLIP, FacePlaces

UNEVEN = 0.35  # share of a field's standard deviation that the other side does not share
SHARED = 0.6  # of the pattern that all shapes of a person have
EVERYBODY, HUMAN = 0.75, 2019  # of the pattern that all people have, and the seed of that
TURNING = 0.6  # off-diagonal entries against diagonal ones
NEVER_OWN = ("eyeLook", "tongue")  # joints and tongue: no skin to differ
TOGETHER_AT = 0.25  # weights at which two shapes have their common field
FIRM_M = 0.012  # the further a shape moves skin, the more bone and muscle lead it
BEND, ADD, JOIN = 0.38, 0.19, 0.32
TOGETHER: tuple[tuple[str, str], ...] = (
    ("jawOpen", "jawOpen"),
    ("jawOpen", "mouthPucker"),
    ("jawOpen", "mouthFunnel"),
    ("jawOpen", "mouthStretchLeft"),
    ("jawOpen", "mouthStretchRight"),
    ("jawOpen", "mouthLowerDownLeft"),
    ("jawOpen", "mouthLowerDownRight"),
    ("jawOpen", "mouthUpperUpLeft"),
    ("jawOpen", "mouthClose"),
    ("mouthPucker", "mouthPucker"),
    ("mouthPucker", "mouthFunnel"),
    ("mouthFunnel", "mouthFunnel"),
    ("mouthStretchLeft", "mouthStretchLeft"),
    ("mouthStretchRight", "mouthStretchRight"),
    ("mouthPressLeft", "mouthPressRight"),
    ("mouthLabiodental", "mouthLabiodental"),
)


def stem(name: str) -> str:
    """The name without its side."""
    return name.removesuffix("Left").removesuffix("Right")


def own_versions(
    head: HeadModel,
    places: FacePlaces,
    names: tuple[str, ...],
    strength: float,
    gain_spread: float,
    seed: int,
) -> Float64Array:
    """(shape, vertex, 3) m: a person's versions of named shapes.

    strength 1 bends a shape by up to about a third of its length; gain_spread is the standard
    deviation of the logarithm of its amount.
    """
    shared = _matrices(places, np.random.default_rng((seed, 1)))
    gains: dict[str, float] = {}
    own = []
    for name in names:
        shape = head.expression_basis[head.expression_index(name)].astype(np.float64)
        if name.startswith(NEVER_OWN):
            own.append(shape)
            continue
        human, rng, side = _generators(seed, name)
        gain = gains.setdefault(stem(name), float(rng.normal()))
        # How far the jaw goes is a matter of habits: the skin over it has to go along.
        free = 0.0 if name.startswith(("jaw", "mouthClose")) else gain_spread * strength
        amount = np.exp(np.clip(free * (gain + UNEVEN * side.normal()), -0.2, 0.2))
        bend = SHARED * shared + (1 - SHARED**2) ** 0.5 * _sided(
            _matrices(places, rng), _matrices(places, side), name, places
        )
        added = _sided(places.noise(rng, 3), places.noise(side, 3), name, places)
        bend = _human(_matrices(places, human), bend, name, places)
        added = _human(places.noise(human, 3), added, name, places)
        length = spread_length(shape, places)
        moved = BEND * np.einsum("vab,vb->va", bend, shape) + ADD * length[:, None] * added
        moved /= 1 + length[:, None] / FIRM_M
        # Bone neither bends nor gains: the teeth stay where the rig has them.
        own.append(
            shape + places.soft[:, None] * ((amount - 1) * shape + strength * amount * moved)
        )
    return np.stack(own)


def common_fields(head: HeadModel, places: FacePlaces, strength: float, seed: int) -> Float64Array:
    """(pair, vertex, 3) m for `TOGETHER`, at full strength of both shapes."""
    fields = []
    for first, second in TOGETHER:
        human, rng, side = _generators(seed, f"{first} {second}")
        lengths = [
            spread_length(head.expression_basis[head.expression_index(name)], places)
            for name in (first, second)
        ]
        length = np.sqrt(lengths[0] * lengths[1])
        length *= TOGETHER_AT / (1 + length / FIRM_M)
        sided = second if second.endswith(("Left", "Right")) else first
        noise = _sided(places.noise(rng, 3), places.noise(side, 3), sided, places)
        noise = _human(places.noise(human, 3), noise, sided, places)
        fields.append(JOIN * strength * (places.soft * length)[:, None] * noise)
    return np.stack(fields)


def common_weights(weights: Float64Array, names: tuple[str, ...]) -> Float64Array:
    """(frame, pair) of weights (frame, shape): their product, 1 at `TOGETHER_AT` and 2 at most."""
    place = {name: index for index, name in enumerate(names)}
    product = np.stack([weights[:, place[a]] * weights[:, place[b]] for a, b in TOGETHER], axis=1)
    share = product / TOGETHER_AT**2
    return 2 * share / (1 + share)


def spread_length(shape: Float64Array, places: FacePlaces) -> Float64Array:
    """(vertex,) m: how far a shape moves the skin around a vertex, edges softened."""
    length = np.linalg.norm(shape, axis=1) * (places.soft > 0)
    weights = places.bells**2
    centres = (weights.T @ length) / np.maximum(weights.T @ (places.soft > 0), 1e-9)
    return (weights @ centres) / np.maximum(weights.sum(axis=1), 1e-9)


def _generators(seed: int, name: str) -> tuple[np.random.Generator, ...]:
    """Of what everybody has, of what a person has on both sides, and on one."""
    both = stem(name).encode()
    seeds = (HUMAN, 1, *both), (seed, 2, *both), (seed, 3, *name.encode())
    return tuple(np.random.default_rng(each) for each in seeds)


def _human(
    everybody: Float64Array, person: Float64Array, name: str, places: FacePlaces
) -> Float64Array:
    """A person's field with the share that all people have, which is symmetric."""
    even = _sided(everybody, np.zeros_like(everybody), name, places) / (1 - UNEVEN**2) ** 0.5
    return EVERYBODY * even + (1 - EVERYBODY**2) ** 0.5 * person


def _matrices(places: FacePlaces, rng: np.random.Generator) -> Float64Array:
    """(vertex, 3, 3) smooth noise."""
    scale = np.full((3, 3), TURNING)
    np.fill_diagonal(scale, 1.0)
    return places.noise(rng, 9).reshape(-1, 3, 3) * scale


def _sided(field: Float64Array, side: Float64Array, name: str, places: FacePlaces) -> Float64Array:
    """A field of the left side, mirrored for the right, evened for the middle; `side` is added."""
    flip = np.outer(FLIP, FLIP) if field.ndim == 3 else FLIP
    mirrored = field[places.mirror] * flip
    if name.endswith("Left"):
        even = field
    elif name.endswith("Right"):
        even = mirrored
    else:
        even = (field + mirrored) / 2**0.5
    return (1 - UNEVEN**2) ** 0.5 * even + UNEVEN * side
