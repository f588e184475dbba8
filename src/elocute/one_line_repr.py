"""One-line reprs of large records: arrays by type and shape, long sequences by length."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

LONGEST = 160
"""Characters of a line; what lies beyond becomes an ellipsis."""


def one_line(self: Any) -> str:
    """The `__repr__` of a dataclass, in one line of about `LONGEST` characters at most.

    Parameters
    ----------
    self
        An instance of the dataclass, which says `__repr__ = one_line`.

    Returns
    -------
    str
    """
    parts, length = [], 0
    for field in fields(self):
        if not field.repr:
            continue
        part = f"{field.name}={brief(getattr(self, field.name, None))}"
        length += len(part) + 2
        if parts and length > LONGEST:
            parts.append("…")
            break
        parts.append(part)
    return f"{type(self).__name__}({', '.join(parts)})"


def brief(value: Any, depth: int = 3) -> str:
    """A value in a few words: arrays by type and shape, long sequences by length.

    Parameters
    ----------
    value
        Anything.
    depth : int
        Levels of lists in lists that are told.

    Returns
    -------
    str
        `<Type object>` where the value's own `__repr__` fails.
    """
    try:
        return _brief(value, depth)
    except Exception:  # it stands in error messages, and may not replace them
        return f"<{type(value).__name__} object>"


def _brief(value: Any, depth: int) -> str:
    if hasattr(value, "dtype") and getattr(value, "shape", ()):
        return f"{value.dtype}{tuple(value.shape)}".replace(",)", ")")
    if isinstance(value, int) and value.bit_length() > 100:
        return f"a whole number of {value.bit_length()} bits"  # Python refuses to print the longest
    if isinstance(value, tuple | list | set | frozenset | dict) and not depth:
        return "…"
    if isinstance(value, tuple | list | set | frozenset | dict) and len(value) > 3:
        return f"{len(value)} × {_cut(brief(next(iter(value)), depth - 1), 30)}"
    if isinstance(value, tuple | list):
        return f"({', '.join(_cut(brief(part, depth - 1), 30) for part in value)})"
    if isinstance(value, dict):
        parts = (f"{brief(key)}: {brief(part, depth - 1)}" for key, part in value.items())
        return "{" + ", ".join(_cut(each, 30) for each in parts) + "}"
    if is_dataclass(value) and not isinstance(value, type):
        return f"{type(value).__name__}(…)"
    return _cut(" ".join(repr(value).split()), 60)


def _cut(text: str, length: int) -> str:
    return text if len(text) <= length else f"{text[: length - 1]}…"
