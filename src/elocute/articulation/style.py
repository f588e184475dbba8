"""Speaking style: how a person articulates, as a handful of numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from pathlib import Path

from elocute.articulation.contacts_and_rest import HOLD_MAX_S
from elocute.errors import InputError
from elocute.files.json_records import finite_number, read_record
from elocute.files.reading import FileKind
from elocute.settings import check_settings, described, setting


@described
@dataclass(frozen=True)
class Style:
    """How a person articulates; the defaults are a plain speaker's.

    Raises
    ------
    InputError
        For a number outside its range.
    """

    amplitude: float = setting(
        1.0, low=0.0, high=2.0, help="Opening of jaw and lips; 1 is a plain speaker's."
    )
    rounding: float = setting(
        1.0, low=0.0, high=2.0, help="Rounding and protrusion of the lips in rounded sounds."
    )
    spread: float = setting(1.0, low=0.0, high=2.0, help="Spreading of the lips in e, i and s.")
    upper_lip: float = setting(1.0, low=0.0, high=2.0, help="Activity of the upper lip.")
    asymmetry: float = setting(
        0.0, low=-1.0, high=1.0, help="More on the left (below 0) or right side of the mouth."
    )
    smile: float = setting(
        0.0, low=0.0, high=1.0, help="A smile that the face wears, in speech and at rest."
    )
    parted_mm: float = setting(
        0.0, unit="mm", low=0.0, high=5.0, help="How far the lips are parted at rest."
    )
    anticipation_s: float = setting(
        0.040, unit="s", low=0.01, high=0.3, help="How early a sound is seen before it is heard."
    )
    carry_s: float = setting(
        0.035, unit="s", low=0.01, high=0.3, help="How long a sound is seen after it is heard."
    )
    closure: float = setting(
        0.2, low=0.01, high=1.0, help="Evidence of p, b or m above which the lips close."
    )
    labiodental: float = setting(
        0.3, low=0.01, high=1.0, help="Evidence of f or v above which lower lip and teeth meet."
    )
    hold_s: float = setting(
        0.06, unit="s", low=0.0, high=HOLD_MAX_S, help="Least time that a closure is held."
    )

    def __post_init__(self) -> None:
        check_settings(self, about="style")


PLAIN = Style()
STYLES: dict[str, Style] = {
    "plain": PLAIN,
    "calm": Style(amplitude=0.78, spread=0.8, anticipation_s=0.075, carry_s=0.065),
    "broad": Style(amplitude=1.25, rounding=1.15, spread=1.2, upper_lip=1.2),
    "mumble": Style(
        amplitude=0.5, rounding=0.7, spread=0.5, upper_lip=0.5, anticipation_s=0.09, carry_s=0.08
    ),
    "crisp": Style(amplitude=1.05, anticipation_s=0.028, carry_s=0.024, hold_s=0.08),
    "rounded": Style(amplitude=0.95, rounding=1.35, spread=0.7),
    "smiling": Style(smile=0.5, spread=1.3, rounding=0.85, upper_lip=1.25),
    "wry": Style(amplitude=0.9, asymmetry=0.45),
    "tense": Style(
        amplitude=0.7, rounding=0.7, spread=1.4, anticipation_s=0.03, carry_s=0.025, hold_s=0.09
    ),
    "drawl": Style(parted_mm=1.5, amplitude=0.9, upper_lip=0.4, anticipation_s=0.1, carry_s=0.11),
    "pouting": Style(amplitude=0.8, rounding=1.6, spread=0.4),
    "lopsided": Style(amplitude=1.1, upper_lip=1.3, asymmetry=-0.6),
}


def parse_mix(text: str) -> dict[str, float]:
    """Read a mix of styles as users type it.

    Parameters
    ----------
    text : str
        "calm:0.7,broad:0.3"; a name without a share counts as one.

    Returns
    -------
    dict of str to float
        Shares that sum to one, by name. Names are not checked.

    Raises
    ------
    InputError
        For shares that are not numbers, negative, or all zero.
    """
    shares: dict[str, float] = {}
    for part in text.split(","):
        name, colon, number = part.strip().partition(":")
        try:
            share = float(number) if colon else 1.0
        except ValueError:
            share = math.nan
        if not name or not 0 <= share < math.inf:
            raise InputError.about(
                f"style {text[:60]!r}",
                found=f"{part.strip()[:60]!r}",
                allowed="NAME or NAME:SHARE,NAME:SHARE with shares from 0",
            )
        shares[name] = shares.get(name, 0.0) + share
    total = sum(shares.values())
    if not 0 < total < math.inf:
        raise InputError.about(
            f"style {text[:60]!r}", found="shares of zero", allowed="one above zero"
        )
    return {name: share / total for name, share in shares.items()}


def mix_styles(shares: dict[str, float]) -> Style:
    """The convex mix of named styles, number by number.

    Parameters
    ----------
    shares : dict of str to float
        Share of each style; they sum to one.

    Returns
    -------
    Style

    Raises
    ------
    InputError
        For a name that is not in `STYLES`.
    """
    for name in shares:
        if name not in STYLES:
            raise InputError.about(
                f"style {name[:60]!r}",
                found="unknown",
                allowed=", ".join(STYLES) + ", a mix of these (calm:0.7,broad:0.3), or a .json "
                "file of style numbers",
            )
    return Style(
        **{
            field.name: sum(
                share * getattr(STYLES[name], field.name) for name, share in shares.items()
            )
            for field in fields(Style)
        }
    )


def resolve_style(given: str | Style) -> Style:
    """The Style that a caller names.

    Parameters
    ----------
    given : str or Style
        A name of STYLES, a mix of them ("calm:0.7,broad:0.3"), a JSON file of a Style's fields, or
        a Style, which is returned as it is.

    Returns
    -------
    Style

    Raises
    ------
    InputError
        Naming what is allowed.
    """
    if isinstance(given, Style):
        return given
    path = Path(given)
    if path.suffix == ".json":
        return _read_style(path)
    name = str(given)
    return STYLES[name] if name in STYLES else mix_styles(parse_mix(name))


def _shares(path: Path, mix: dict[str, object]) -> dict[str, float]:
    """Shares of a mix as `elocute style fit` writes it, made to sum to one. Raises InputError."""
    numbers = {name: finite_number(share) for name, share in mix.items()}
    shares = {name: share for name, share in numbers.items() if share is not None}
    total = sum(shares.values())
    if len(shares) < len(mix) or min(shares.values(), default=-1) < 0 or not 0 < total < 1e9:
        raise InputError.about(path, found="no mix of styles", allowed='{"mix": {"NAME": share}}')
    return {name: share / total for name, share in shares.items()}


STYLE_FILE = FileKind("an object of numbers", 65_536)


def _read_style(path: Path) -> Style:
    record = read_record(path, STYLE_FILE)
    own = record.get("vector")  # as `elocute style fit --new` writes
    if isinstance(own, dict):
        record = own
    elif isinstance(record.get("mix"), dict):
        return mix_styles(_shares(path, record["mix"]))
    known = [field.name for field in fields(Style)]
    unknown = sorted(set(record) - set(known))
    if unknown:
        found = f"unknown fields {', '.join(unknown)[:80]}"
        raise InputError.about(path, found=found, allowed=", ".join(known))
    try:
        return replace(Style(), **record)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
