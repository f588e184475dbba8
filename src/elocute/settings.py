"""Settings, spelled once: a field with its default, range, unit and a sentence of help.

    @described
    @dataclass(frozen=True)
    class TrainConfig:
        '''Settings of a training.'''

        epochs: int = setting(50, low=1, high=100_000, help="Passes over the training part.")

        def __post_init__(self) -> None:
            check_settings(self)

Validation, docstring, options of the command line and the documentation's tables come from it.
"""

from __future__ import annotations

import math
import numbers
import types
from collections.abc import Sequence
from dataclasses import MISSING, Field, dataclass, field, fields
from functools import lru_cache
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

from elocute.errors import InputError
from elocute.one_line_repr import brief

KEY = "setting"
SEED_MAX = 2**31 - 1
"""The greatest seed that every generator of random numbers takes."""
SHOWN_MAX = 60
"""Characters of a value that an error shows."""
Class = TypeVar("Class", bound=type)


@dataclass(frozen=True)
class Setting:
    """What is known of a setting beside its type and default.

    low and high may be taken; what must lie above a number has `above`. `choices` are of texts.
    """

    help: str
    unit: str = ""
    low: float | None = None
    high: float | None = None
    above: float | None = None
    choices: tuple[str, ...] = ()

    @property
    def allowed(self) -> str:
        """The range in words: `1 to 240 frames/s`; empty where anything may be."""
        if self.choices:
            return ", ".join(self.choices)
        high = None if self.high is None else _number(self.high)
        if self.above is not None:
            text = f"above {_number(self.above)}" + (f", up to {high}" if high else "")
        elif self.low is not None:
            text = f"{_number(self.low)} to {high}" if high else f"{_number(self.low)} or more"
        else:
            text = f"up to {high}" if high else ""
        return f"{text} {self.unit}".strip() if text else ""

    @property
    def text(self) -> str:
        """The help with unit and range in it."""
        known = self.allowed or self.unit
        return f"{self.help.rstrip('.')} ({known})." if known else self.help


def setting(
    default: Any = MISSING,
    *,
    help: str,
    unit: str = "",
    low: float | None = None,
    high: float | None = None,
    above: float | None = None,
    choices: Sequence[str] = (),
) -> Any:
    """A field of a settings dataclass; its default is the first argument."""
    about = Setting(help, unit, low, high, above, tuple(choices))
    return field(default=default, metadata={KEY: about})


def settings_of(cls: type) -> list[tuple[Field[Any], Setting]]:
    """The fields of a settings dataclass that are settings, in their order."""
    return [(each, each.metadata[KEY]) for each in fields(cls) if KEY in each.metadata]


@lru_cache
def types_of(cls: type) -> dict[str, tuple[Any, bool]]:
    """Of each field its type, without `| None`, and whether None may be."""
    return {name: _without_none(hint) for name, hint in get_type_hints(cls).items()}


def check_settings(given: Any, error: type[InputError] = InputError, about: str = "") -> None:
    """Raise `error` for the first setting of another type or outside its range.

    about  what the settings are of, where their names alone would not tell: `style`
    """
    for each, known in settings_of(type(given)):
        value = getattr(given, each.name)
        kind, optional = types_of(type(given))[each.name]
        if (value is None and optional) or _fits(value, kind, known):
            continue
        shown = f"{value:g}" if isinstance(value, float) else brief(value)
        raise error.about(
            f"{about} `{each.name}`".strip(),
            found=shown[:SHOWN_MAX],
            allowed=_allowed(kind, known),
        )


def settings_table(cls: type) -> str:
    """The settings of a dataclass as a Markdown table."""
    rows = ["| setting | default | allowed | |", "|---|---|---|---|"]
    for each, known in settings_of(cls):
        allowed = known.unit or _named(types_of(cls)[each.name][0])
        if known.allowed:
            allowed = _allowed(types_of(cls)[each.name][0], known)
        cells = (f"`{each.name}`", _default(each), allowed, known.help)
        rows.append(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
    return "\n".join(rows)


def described(cls: Class) -> Class:
    """Add what each setting is to the docstring of its dataclass."""
    found = settings_of(cls)
    wide = max((len(each.name) for each, _ in found), default=0)
    lines = [f"    {e.name:{wide}}  {known.text} Default: {_default(e)}." for e, known in found]
    if cls.__doc__ is not None and lines:  # python -OO has none
        cls.__doc__ = "\n".join([cls.__doc__.rstrip(), "", *lines, ""])
    return cls


def _fits(value: Any, kind: Any, known: Setting) -> bool:
    if get_origin(kind) is tuple:
        parts = get_args(kind)
        fitting = isinstance(value, tuple) and len(value) == len(parts)
        return fitting and all(map(_fits, value, parts, [known] * len(parts)))
    if kind is bool:
        return isinstance(value, bool)
    if kind in (int, float):
        number = numbers.Integral if kind is int else numbers.Real
        return isinstance(value, number) and not isinstance(value, bool) and _inside(value, known)
    if kind is str:
        return isinstance(value, str) and (not known.choices or value in known.choices)
    return isinstance(value, kind)


def _inside(value: Any, known: Setting) -> bool:
    try:
        finite = math.isfinite(value)
    except OverflowError:  # a whole number beyond every float
        return False
    return (
        finite
        and (known.low is None or value >= known.low)
        and (known.high is None or value <= known.high)
        and (known.above is None or value > known.above)
    )


def _without_none(hint: Any) -> tuple[Any, bool]:
    """The type, and whether None may stand in its place."""
    if get_origin(hint) not in (Union, types.UnionType):
        return hint, False
    (kind,) = (part for part in get_args(hint) if part is not type(None))
    return kind, True


def _allowed(kind: Any, known: Setting) -> str:
    parts = get_args(kind) if get_origin(kind) is tuple else ()
    each = f"{len(parts)} numbers, each " if parts else ""
    return each + (known.allowed or _named(kind))


def _named(kind: Any) -> str:
    words = {int: "a whole number", float: "a number", bool: "true or false", str: "a text"}
    return words.get(kind, getattr(kind, "__name__", str(kind)))


def _number(value: float) -> str:
    return str(value) if isinstance(value, int) else f"{value:g}"


def _default(each: Field[Any]) -> str:
    value = each.default
    if value is MISSING:
        return "must be given"
    if value is None or value == "":
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return " × ".join(map(str, value))
    return value if isinstance(value, str) else _number(value)
