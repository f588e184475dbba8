"""A look: what a person of the built-in head looks like, as plain choices."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any

from elocute.errors import HeadError
from elocute.numerics.input_checks import real_number
from elocute.one_line_repr import brief

HAIR = ("none", "swept", "crop", "slick", "curls", "coils", "afro", "buzz", "bob", "long", "waves")
HAIR += ("ponytail", "bun")
BROWS = ("natural", "straight", "full", "fine", "arched", "soft")
EYES = ("brown", "brownlight", "green", "blue", "lightblue", "bluegreen", "grey", "ice")
HAIR_COLOURS = {
    "black": (0.020, 0.017, 0.016),
    "dark-brown": (0.060, 0.032, 0.020),
    "brown": (0.140, 0.072, 0.038),
    "light-brown": (0.260, 0.150, 0.080),
    "auburn": (0.220, 0.070, 0.030),
    "copper": (0.420, 0.140, 0.045),
    "blond": (0.830, 0.510, 0.225),
    "grey": (0.320, 0.310, 0.300),
    "white": (0.720, 0.700, 0.670),
}
"""Linear colour of a bright strand."""
CLOTHES = {"none": "", "crew": "crew", "roll": "roll", "collar": "collar"}
CLOTHES_COLOURS = {
    "white": (0.66, 0.65, 0.63),
    "grey": (0.17, 0.174, 0.178),
    "black": (0.014, 0.014, 0.015),
    "navy": (0.016, 0.024, 0.050),
    "blue": (0.050, 0.100, 0.190),
    "green": (0.030, 0.075, 0.048),
    "olive": (0.078, 0.078, 0.042),
    "red": (0.190, 0.024, 0.022),
    "plum": (0.078, 0.026, 0.046),
    "rust": (0.200, 0.066, 0.030),
    "sand": (0.400, 0.330, 0.245),
    "teal": (0.018, 0.075, 0.082),
}
"""Linear colour of cloth."""


@dataclass(frozen=True)
class Look:
    """What a person looks like.

    Parameters
    ----------
    age : float
        Of the skin, years, 18 to 80.
    sex : float
        Of the skin, 0 woman to 1 man.
    tone : float, optional
        0 light to 1 dark; None: that of the head's own colours.
    freckles, stubble : float
        0 none to 1 many.
    eyes : str
        Colour of the iris, one of `EYES`.
    pupils : float
        Their diameter in mm, 2 (bright light, old age) to 7 (dusk).
    brows : str
        One of `BROWS`.
    lashes : float
        0 none to 1 long.
    hair : str
        One of `HAIR`.
    hair_colour : str
        One of `HAIR_COLOURS`.
    clothes : str
        One of `CLOTHES`.
    clothes_colour : str
        One of `CLOTHES_COLOURS`.

    Raises
    ------
    HeadError
        For a choice that there is not.
    """

    age: float = 30.0
    sex: float = 0.0
    tone: float | None = None
    freckles: float = 0.0
    stubble: float = 0.0
    eyes: str = "brown"
    pupils: float = 4.2
    brows: str = "natural"
    lashes: float = 1.0
    hair: str = "ponytail"
    hair_colour: str = "dark-brown"
    clothes: str = "crew"
    clothes_colour: str = "grey"

    def __post_init__(self) -> None:
        for name, known in (
            ("eyes", EYES),
            ("brows", (*BROWS, "none")),
            ("hair", HAIR),
            ("hair_colour", HAIR_COLOURS),
            ("clothes", CLOTHES),
            ("clothes_colour", CLOTHES_COLOURS),
        ):
            choice = getattr(self, name)
            if not isinstance(choice, str) or choice not in known:
                found = brief(choice)
                raise HeadError.about(f"look: {name}", found=found, allowed=", ".join(known))
        ranges = {"age": (18, 80), "sex": (0, 1), "freckles": (0, 1), "stubble": (0, 1)}
        ranges |= {"lashes": (0, 1), "tone": (0, 1), "pupils": (2, 7)}
        for name, (low, high) in ranges.items():
            value = getattr(self, name)
            if value is None and name == "tone":
                continue
            number = real_number(value)
            if number is None or not low <= number <= high:
                raise HeadError.about(
                    f"look: {name}", found=brief(value), allowed=f"{low} to {high}"
                )

    def record(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def look_of_record(record: object) -> Look | None:
    """A look from JSON, or None from null. Raises HeadError for anything else."""
    if record is None:
        return None
    names = {field.name for field in fields(Look)}
    if not isinstance(record, dict) or not set(record) <= names:
        raise HeadError.about("look", found=brief(record), allowed=", ".join(sorted(names)))
    return Look(**record)
