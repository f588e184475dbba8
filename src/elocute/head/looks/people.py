"""Who looks how: the named faces, faces by seed, and what a user changes of either."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from elocute.errors import HeadError
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from elocute.head.looks.look import (
    BROWS,
    CLOTHES,
    CLOTHES_COLOURS,
    EYES,
    HAIR,
    HAIR_COLOURS,
    Look,
)
from elocute.one_line_repr import brief

PEOPLE = {
    "mean": Look(
        age=27, sex=0.2, tone=0.22, eyes="brown", brows="soft", hair="ponytail",
        hair_colour="dark-brown",
        clothes_colour="grey",
    ),
    "ada": Look(
        age=29, sex=0.0, tone=0.14, freckles=0.5, eyes="green", brows="arched", hair="long",
        hair_colour="auburn",
        clothes_colour="green",
    ),
    "ben": Look(
        age=35, sex=1.0, tone=0.25, stubble=0.5, lashes=0.4, eyes="blue", brows="straight",
        hair="crop", hair_colour="brown",
        clothes="collar", clothes_colour="navy",
    ),
    "chidi": Look(
        age=41, sex=1.0, tone=0.92, lashes=0.4, eyes="brown", brows="full", hair="buzz",
        hair_colour="black",
        clothes_colour="sand",
    ),
    "dana": Look(
        age=53, sex=0.0, tone=0.18, eyes="lightblue", brows="fine", hair="bun",
        hair_colour="blond",
        clothes="roll", clothes_colour="teal",
    ),
    "esi": Look(
        age=23, sex=0.0, tone=0.8, eyes="brown", brows="soft", hair="curls",
        hair_colour="dark-brown",
        clothes_colour="rust",
    ),
    "feng": Look(
        age=61, sex=1.0, tone=0.34, stubble=0.15, lashes=0.4, eyes="brownlight", brows="straight",
        hair="swept", hair_colour="black",
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
NUMBERS = ("age", "sex", "tone", "freckles", "stubble", "lashes")
CHOICES = ("eyes", "brows", "hair", "hair_colour", "clothes", "clothes_colour")
ALLOWED = (
    f"auto, none, {', '.join(PEOPLE)} or a seed, and parts of it ("
    f"{', '.join((*NUMBERS, *CHOICES))}), as in otto or auto,hair=long,age=60"
)
MENS_HAIR = ("swept", "crop", "slick", "curls", "coils", "buzz")
WOMENS_HAIR = tuple(style for style in HAIR if style not in ("none", "buzz"))
"""What seeds draw from."""
GREY_FROM, GREY_WITHIN = 45.0, 35.0
"""Years from which hair may be grey, and after which it is."""
DARK_HAIR_FROM = 0.5
"""Skin of a darker tone goes with dark hair and brown eyes."""
SEED_MIX = 1729
"""Keeps what a seed draws here apart from the face that it draws."""


def resolve_look(
    choice: str | Look | None, identity: str = "mean", tone: float | None = None
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
    look = _named(identity if first == "auto" else first, tone, lenient=first == "auto")
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
    tone = None
    if identity not in PEOPLE:
        mean, *slope = load_builtin_head().tone_basis.tolist()
        given = resolve_identity(identity)[: len(slope)]
        tone = float(np.clip(mean + given @ np.array(slope[: len(given)]), 0, 1))
    return resolve_look(choice, identity, tone)


def _named(name: str, tone: float | None, *, lenient: bool) -> Look | None:
    if name == "none" and not lenient:
        return None
    if name in PEOPLE:
        return PEOPLE[name]
    if name.isascii() and name.isdigit():
        return random_look(int(name), tone)
    if lenient:  # an identity from a file
        return PEOPLE["mean"] if tone is None else replace(PEOPLE["mean"], tone=tone)
    raise _refused(name)


def _changed(look: Look | None, name: str, value: str, part: str) -> Look:
    if look is None or name not in (*NUMBERS, *CHOICES):
        raise _refused(part)
    if name in CHOICES:
        return replace(look, **{name: value})
    try:
        return replace(look, **{name: float(value)})
    except ValueError:
        raise _refused(part) from None


def _refused(found: object) -> HeadError:
    return HeadError.about("look", found=brief(found), allowed=ALLOWED)


def random_look(seed: int, tone: float | None = None) -> Look:
    """A look drawn by a seed: hair, brows and eyes that go with its age, sex and tone.

    Parameters
    ----------
    seed : int
        The same seed gives the same look.
    tone : float, optional
        Of the skin, where the identity has one; drawn otherwise.

    Returns
    -------
    Look
    """
    draw = np.random.default_rng([SEED_MIX, seed])
    man = bool(draw.random() < 0.5)
    age = float(np.round(draw.triangular(20, 30, 75)))
    drawn = float(draw.uniform(0.05, 0.95))
    tone = drawn if tone is None else min(1.0, max(0.0, tone))
    grey = draw.random() < (age - GREY_FROM) / GREY_WITHIN
    dark = tone > DARK_HAIR_FROM
    return Look(
        age=age,
        sex=float(man),
        tone=round(tone, 3),
        freckles=0.0 if dark else float(np.round(max(0, draw.normal(0, 0.3)), 2).clip(0, 1)),
        stubble=float(np.round(draw.uniform(0, 0.8), 2)) if man else 0.0,
        lashes=0.4 if man else 1.0,
        eyes="brown" if dark else _one_of(draw, EYES),
        brows=_one_of(draw, ("straight", "full", "natural") if man else BROWS),
        hair=_one_of(draw, MENS_HAIR if man else WOMENS_HAIR),
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
