"""Looks of named faces and of faces by seed, and what a user changes of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from elocute.array_types import Float32Array
from elocute.errors import HeadError
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from elocute.head.looks.look import (
    CLOTHES,
    CLOTHES_COLOURS,
    EYES,
    HAIR_COLOURS,
    Look,
)
from elocute.head.model import HeadModel
from elocute.one_line_repr import brief

PEOPLE = {
    "mean": Look(
        age=27, sex=0.2, tone=0.22, eyes="brown", brows="soft", hair="ponytail",
        hair_colour="dark-brown",
        clothes_colour="grey",
    ),
    "ada": Look(
        age=29, sex=0.0, tone=0.14, freckles=0.5, eyes="green", brows="arched", hair="waves",
        hair_colour="auburn",
        clothes_colour="green",
    ),
    "ben": Look(
        age=35, sex=1.0, tone=0.25, stubble=0.5, lashes=0.4, eyes="blue", brows="straight",
        hair="crop", hair_colour="brown",
        clothes="collar", clothes_colour="navy",
    ),
    "chidi": Look(
        age=41, sex=1.0, tone=0.92, lashes=0.4, eyes="brown", brows="full", hair="coils",
        hair_colour="black",
        clothes_colour="sand",
    ),
    "dana": Look(
        age=53, sex=0.0, tone=0.18, eyes="lightblue", brows="fine", hair="bob",
        hair_colour="blond",
        clothes="roll", clothes_colour="teal",
    ),
    "esi": Look(
        age=23, sex=0.0, tone=0.8, eyes="brown", brows="soft", hair="curls",
        hair_colour="dark-brown",
        clothes_colour="rust",
    ),
    "feng": Look(
        age=61, sex=1.0, tone=0.34, stubble=0.15, lashes=0.4, eyes="brownlight", brows="natural",
        hair="slick", hair_colour="black",
        clothes="collar", clothes_colour="blue",
    ),
    "hana": Look(
        age=20, sex=0.0, tone=0.2, eyes="brown", brows="natural", hair="long",
        hair_colour="dark-brown",
        clothes="collar", clothes_colour="white",
    ),
    "otto": Look(
        age=74, sex=1.0, tone=0.16, stubble=0.1, lashes=0.3, eyes="grey", brows="full",
        hair="swept", hair_colour="grey",
        clothes="roll", clothes_colour="plum",
    ),
}  # fmt: skip
"""By the name of the identity."""
NUMBERS = ("age", "sex", "tone", "freckles", "stubble", "lashes", "pupils")
CHOICES = ("eyes", "brows", "hair", "hair_colour", "clothes", "clothes_colour")
ALLOWED = (
    f"auto, none, {', '.join(PEOPLE)} or a seed, and parts of it ("
    f"{', '.join((*NUMBERS, *CHOICES))}), as in otto or auto,hair=long,age=60"
)
MENS_HAIR, MENS_DARK_HAIR = ("swept", "crop", "slick", "curls"), ("crop", "curls", "coils", "buzz")
WOMENS_HAIR = ("long", "waves", "bob", "ponytail", "bun", "curls")
WOMENS_DARK_HAIR = ("long", "ponytail", "bun", "curls", "coils", "afro")
MENS_BROWS, WOMENS_BROWS = ("straight", "full", "natural"), ("natural", "fine", "arched", "soft")
"""What seeds draw from; dark hair is that of dark skin."""
AGES = (20, 30, 75)
"""Youngest, most frequent and oldest, in years."""
GREY_FROM, GREY_WITHIN = 45.0, 35.0
"""Years from which hair may be grey, and after which it is."""
DARK_HAIR_FROM = 0.45
"""Skin of a darker tone goes with dark hair and brown eyes."""
SEED_MIX = 1729
"""Keeps what a seed draws here apart from the face that it draws."""


def resolve_look(
    choice: str | Look | None,
    identity: str = "mean",
    tone: float | None = None,
    sex: float | None = None,
    age: float | None = None,
) -> Look | None:
    """The look that a caller names.

    Parameters
    ----------
    choice : str, Look or None
        "auto": that of the identity; "none" or None: the bare head; a person's name; a seed; any
        of them changed in parts, as in "auto,hair=long,age=60". A Look is returned as it is.
    identity : str
        The identity it belongs to: a name, a seed, or anything else.
    tone : float, optional
        Of the identity's skin, 0 light to 1 dark, where the look leaves it open.
    sex, age : float, optional
        Of the identity's face, 0 woman to 1 man, and years, where it is a seed's.

    Returns
    -------
    Look or None

    Raises
    ------
    HeadError
        For anything else, naming what is allowed.
    """
    if choice is None or isinstance(choice, Look):
        return choice
    if not isinstance(choice, str):
        raise _refused(choice)
    first, *parts = [part.strip() for part in choice.split(",")]
    if "=" in first:
        first, parts = "auto", [first, *parts]
    traits = (tone, sex, age)
    look = _named(identity if first == "auto" else first, *traits, lenient=first == "auto")
    if look is None and parts:
        raise _refused(choice)
    for part in parts:
        name, _, value = part.partition("=")
        look = _changed(look, name.strip().replace("-", "_"), value.strip(), part)
    return look


def identity_look(choice: str | Look | None, identity: str) -> Look | None:
    """The look that a caller names, of a face of the built-in head.

    Parameters
    ----------
    choice : str, Look or None
        As `resolve_look` takes it.
    identity : str
        A name, a seed or a .json file, as `resolve_identity` takes it.

    Returns
    -------
    Look or None

    Raises
    ------
    HeadError
        For an unknown look or identity.
    """
    if identity in PEOPLE:
        return resolve_look(choice, identity)
    return resolve_look(choice, identity, *_traits(resolve_identity(identity)))


def person(identity: str) -> HeadModel:
    """The built-in head with a face, in the look that goes with it.

    Parameters
    ----------
    identity : str
        A name, a seed or a .json file, as `resolve_identity` takes it.

    Returns
    -------
    HeadModel

    Raises
    ------
    HeadError
        For an unknown identity.
    """
    face = load_builtin_head().with_identity(resolve_identity(identity))
    return replace(face, look=identity_look("auto", identity))


def face_look(coefficients: Float32Array) -> Look:
    """The look of a face that has neither name nor seed, such as one that was captured.

    Parameters
    ----------
    coefficients : (identity,)
        Of the built-in head, standard deviations; at most as many as it has.

    Returns
    -------
    Look
        That of the named person who is nearest in tone, sex and age, with the face's own.
    """
    return _nearest(*_traits(coefficients))


def _traits(coefficients: Float32Array) -> tuple[float, float, float]:
    """Tone, 0 light to 1 dark; sex, 0 woman to 1 man; age, years."""
    head = load_builtin_head()
    bases = np.vstack([head.tone_basis, head.trait_basis])
    known = coefficients[: bases.shape[1] - 1]
    tone, sex, age = (bases[:, 0] + bases[:, 1 : 1 + len(known)] @ known).tolist()
    return min(1.0, max(0.0, tone)), min(1.0, max(0.0, sex)), min(max(age, AGES[0]), AGES[2])


def _nearest(tone: float | None, sex: float | None, age: float | None) -> Look:
    asked = {"tone": tone, "sex": sex, "age": age}
    known = {name: round(value, 3) for name, value in asked.items() if value is not None}
    if not known:
        return PEOPLE["mean"]
    reach = {"tone": 1.0, "sex": 1.0, "age": AGES[2] - AGES[0]}

    def apart(look: Look) -> float:
        return sum(((getattr(look, name) - known[name]) / reach[name]) ** 2 for name in known)

    return replace(min(PEOPLE.values(), key=apart), **known)


def _named(
    name: str, tone: float | None, sex: float | None, age: float | None, *, lenient: bool
) -> Look | None:
    if name == "none" and not lenient:
        return None
    if name in PEOPLE:
        return PEOPLE[name]
    if name.isascii() and name.isdigit():
        return random_look(int(name), tone, sex, age)
    if lenient:  # an identity from a file
        return _nearest(tone, sex, age)
    raise _refused(name)


def _changed(look: Look | None, name: str, value: str, part: str) -> Look:
    if look is None or name not in (*NUMBERS, *CHOICES):
        raise _refused(part)
    if name in CHOICES:
        return replace(look, **{name: value})
    try:
        number = float(value)
    except ValueError:
        raise _refused(part) from None
    return replace(look, **{name: number})


def _refused(found: object) -> HeadError:
    return HeadError.about("look", found=brief(found), allowed=ALLOWED)


def random_look(
    seed: int, tone: float | None = None, sex: float | None = None, age: float | None = None
) -> Look:
    """A look drawn by a seed: hair, brows and eyes that go with its age, sex and tone.

    Parameters
    ----------
    seed : int
        The same seed gives the same look.
    tone : float, optional
        Of the skin, where the identity has one; drawn otherwise.
    sex, age : float, optional
        Of the face, 0 woman to 1 man, and years; drawn otherwise.

    Returns
    -------
    Look
    """
    draw = np.random.default_rng([SEED_MIX, seed])
    drawn_man, drawn_age = bool(draw.random() < 0.5), float(draw.triangular(*AGES))
    man = drawn_man if sex is None else sex > 0.5
    age = round(drawn_age if age is None else min(max(age, AGES[0]), AGES[2]))
    drawn = float(draw.uniform(0.05, 0.95))
    tone = drawn if tone is None else min(1.0, max(0.0, tone))
    grey = draw.random() < (age - GREY_FROM) / GREY_WITHIN
    dark = tone > DARK_HAIR_FROM
    if man:
        hair = MENS_DARK_HAIR if dark else MENS_HAIR
    else:
        hair = WOMENS_DARK_HAIR if dark else WOMENS_HAIR
    return Look(
        age=float(age),
        sex=float(man),
        tone=round(tone, 3),
        freckles=0.0 if dark else float(np.round(max(0, draw.normal(0, 0.3)), 2).clip(0, 1)),
        stubble=float(np.round(draw.uniform(0, 0.8), 2)) if man else 0.0,
        lashes=0.4 if man else 1.0,
        eyes="brown" if dark else _one_of(draw, EYES),
        brows=_one_of(draw, MENS_BROWS if man else WOMENS_BROWS),
        hair=_one_of(draw, hair),
        hair_colour=_hair_colour(draw, dark, bool(grey)),
        clothes_colour=_one_of(draw, tuple(CLOTHES_COLOURS)),
        clothes=_one_of(draw, tuple(CLOTHES)[1:]),
    )


def _hair_colour(draw: np.random.Generator, dark: bool, grey: bool) -> str:
    if grey:
        return _one_of(draw, ("grey", "white"))
    coloured = [name for name in HAIR_COLOURS if name not in ("grey", "white")]
    return _one_of(draw, ("black", "dark-brown") if dark else tuple(coloured))


def _one_of(draw: np.random.Generator, names: tuple[str, ...]) -> str:
    return names[int(draw.integers(len(names)))]
