"""Settings, spelled once: a field with its default, range, unit and a sentence of help.

    @described
    @dataclass(frozen=True)
    class TrainConfig:
        '''Settings of a training.'''

        epochs: int = setting(50, low=1, high=100_000, help="Passes over the training part.")

        def __post_init__(self) -> None:
            check_settings(self)

Validation, docstrings and options of the command line come from it.
"""

from __future__ import annotations

import functools
import inspect
import math
import numbers
import re
import types
from collections.abc import Callable, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields
from difflib import get_close_matches
from functools import lru_cache
from typing import Any, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from elocute.errors import InputError
from elocute.one_line_repr import brief

KEY = "setting"
SEED_MAX = 2**31 - 1
"""The greatest seed that every generator of random numbers takes."""
SHOWN_MAX = 60
"""Characters of a value that an error shows."""
Class = TypeVar("Class", bound=type)
Function = TypeVar("Function", bound=Callable[..., Any])
_SECTION = re.compile(r"^(?=\w+\n---)", re.M)
"""The heading of a section of a docstring."""


@dataclass(frozen=True)
class Setting:
    """What is known of a setting beside its type and default: a sentence of help, and its unit.

    A number lies from `low` to `high`, or is greater than `above`; of texts only the choices are
    allowed, or any where there are none.
    """

    help: str
    unit: str = ""
    low: float | None = None
    high: float | None = None
    above: float | None = None
    choices: tuple[str, ...] = ()

    @property
    def allowed(self) -> str:
        """The range in words: `1 to 240 frames/s`; empty where anything is allowed."""
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

    def holds(self, number: Any) -> bool:
        """Whether a number is finite and within the range."""
        try:
            finite = math.isfinite(number)
        except OverflowError:  # a whole number beyond every float
            return False
        return (
            finite
            and (self.low is None or number >= self.low)
            and (self.high is None or number <= self.high)
            and (self.above is None or number > self.above)
        )

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
    """A field of a settings dataclass, with what a `Setting` knows; required without a default."""
    about = Setting(help, unit, low, high, above, tuple(choices))
    return field(default=default, metadata={KEY: about})


@lru_cache
def settings_of(cls: type) -> list[tuple[Field[Any], Setting]]:
    """The fields of a settings dataclass that are settings, in their order."""
    return [(each, each.metadata[KEY]) for each in fields(cls) if KEY in each.metadata]


def setting_of(cls: type, name: str) -> Setting:
    """What is known of one setting of a dataclass."""
    return next(known for each, known in settings_of(cls) if each.name == name)


@lru_cache
def types_of(cls: type) -> dict[str, tuple[Any, bool]]:
    """The type of each field of a dataclass without `| None`, and whether None is allowed."""
    return {name: _without_none(hint) for name, hint in get_type_hints(cls).items()}


def check_settings(
    settings: Any,
    error: type[InputError] = InputError,
    about: str = "",
    *,
    of: type | None = None,
) -> None:
    """Refuse settings of another type or outside their range, by an `error` for the first of them.

    `about` says what the settings are of, where their names alone would not say it: "style". With
    `of`, a class that the dataclass inherits from, its settings alone are checked.
    """
    cls = of or type(settings)
    for each, known in settings_of(cls):
        value = getattr(settings, each.name)
        kind, optional = types_of(cls)[each.name]
        if (value is None and optional) or _fits(value, kind, known):
            continue
        shown = f"{value:g}" if isinstance(value, float) else brief(value)
        raise error.about(
            f"{about} `{each.name}`".strip(),
            found=shown[:SHOWN_MAX],
            allowed=_allowed(kind, known),
        )


def described(cls: Class) -> Class:
    """Add a Parameters section to the docstring of a dataclass, an entry for each setting.

    Sections that its docstring has, such as Raises, follow the new one.
    """
    listed = settings_of(cls)
    if cls.__doc__ is not None and listed:  # python -OO has none
        summary, *sections = _SECTION.split(inspect.cleandoc(cls.__doc__), maxsplit=1)
        parameters = "\n".join(["Parameters", "----------", *(_entry(*each) for each in listed)])
        cls.__doc__ = "\n\n".join([summary.rstrip(), parameters, *sections]) + "\n"
    return cls


def taking(cls: type) -> Callable[[Function], Function]:
    """A decorator for a function that takes the settings of a dataclass as `**settings`.

    The function then shows each setting that it does not name itself in its signature and
    docstring, and refuses other names as Python does, with the nearest one.
    """

    def decorate(function: Function) -> Function:
        own = inspect.signature(function)
        before = [each for each in own.parameters.values() if each.kind != each.VAR_KEYWORD]
        added = [known for known in settings_of(cls) if known[0].name not in own.parameters]
        alone = inspect.Parameter.KEYWORD_ONLY
        shown = [
            inspect.Parameter(each.name, alone, default=each.default, annotation=each.type)
            for each, _ in added
        ]
        names = [each.name for each in (*before, *shown)]

        @functools.wraps(function)
        def call(*args: Any, **given: Any) -> Any:
            for name in given:
                if name not in names:
                    near = "".join(f"; {each!r}?" for each in get_close_matches(name, names, 1))
                    raise TypeError(f"{function.__name__}() has no argument {name!r}{near}")
            return function(*args, **given)

        call.__signature__ = own.replace(parameters=[*before, *shown])  # type: ignore[attr-defined]
        if call.__doc__ is not None:  # python -OO has none
            summary, parameters, *others = _SECTION.split(inspect.cleandoc(call.__doc__))
            lines = "\n".join(_entry(*each) for each in added)
            sections = [summary.rstrip(), f"{parameters.rstrip()}\n{lines}", *others]
            call.__doc__ = "\n\n".join(sections) + "\n"
        return cast(Function, call)

    return decorate


def _entry(each: Field[Any], known: Setting) -> str:
    return f"{_declared(each)}\n    {known.text}"


def _declared(each: Field[Any]) -> str:
    """Name, type and default of a field, as numpydoc writes them."""
    kind = each.type if isinstance(each.type, str) else getattr(each.type, "__name__", each.type)
    kind = str(kind).removesuffix(" | None")
    if each.default is MISSING:
        return f"{each.name} : {kind}"
    if each.default is None:
        return f"{each.name} : {kind}, optional"
    return f"{each.name} : {kind}, default {each.default!r}"


def _fits(value: Any, kind: Any, known: Setting) -> bool:
    if get_origin(kind) is tuple:
        parts = get_args(kind)
        fitting = isinstance(value, tuple) and len(value) == len(parts)
        return fitting and all(map(_fits, value, parts, [known] * len(parts)))
    if kind is bool:
        return isinstance(value, bool)
    if kind in (int, float):
        number = numbers.Integral if kind is int else numbers.Real
        return isinstance(value, number) and not isinstance(value, bool) and known.holds(value)
    if kind is str:
        return isinstance(value, str) and (not known.choices or value in known.choices)
    return isinstance(value, kind)


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
