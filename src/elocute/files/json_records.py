"""JSON of limited size whose numbers are finite: no NaN, no Infinity, nothing beyond a float."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

from elocute.errors import InputError
from elocute.files.atomic import write_atomically
from elocute.files.reading import FileKind, bytes_text, read_bytes

MEMORY_MAX_BYTES = 1_000_000_000
"""What a JSON text may take in memory. Empty lists take twenty times their text."""
LIST_BYTES, DICT_BYTES, KEY_BYTES, ITEM_BYTES, TEXT_BYTES = 64, 64, 100, 32, 50
INTEGER_MAX_DIGITS = 18
"""Whole numbers fit into 64 bits, so that no later step meets one that it cannot hold."""


DEPTH_MAX = 100
"""Lists and objects within each other: no file needs more, and walking deeper ones would fail."""
_TEXTS = re.compile(r'"(?:[^"\\]|\\.)*+"', re.DOTALL)


def read_record(path: str | Path, kind: FileKind) -> dict[str, Any]:
    """Read a JSON object from a file.

    Raises the kind's error for a file that is missing, too large or not regular, or anything else.
    """
    return as_record(read_json(path, kind), path, kind.allowed, kind.error)


def read_json(path: str | Path, kind: FileKind) -> Any:
    """Read a JSON value of any type from a file; raises as `read_bytes` and `parse_json`."""
    return parse_json(read_bytes(path, kind), path, allowed=kind.allowed, error=kind.error)


def as_record(
    value: Any, subject: str | Path, allowed: str, error: type[InputError] = InputError
) -> dict[str, Any]:
    """The value itself, where it is a JSON object; raises `error` about its source for others."""
    if isinstance(value, dict):
        return value
    raise error.about(subject, found=f"JSON of a {type(value).__name__}", allowed=allowed)


def parse_json(
    data: bytes | str,
    subject: str | Path,
    *,
    allowed: str,
    error: type[InputError] = InputError,
    nan: bool = False,
) -> Any:
    """Parse a JSON text, UTF-8 with or without a byte-order mark, from `subject`.

    Whole numbers have at most `INTEGER_MAX_DIGITS` digits, fractions are finite; NaN, which JSON
    does not have, is taken only where `nan` says so. Raises `error` for anything else, for a text
    that would take more than `MEMORY_MAX_BYTES` in memory, and for one nested deeper than
    `DEPTH_MAX`.
    """
    constant = _nan_alone if nan else _refuse_constant
    try:
        if (needed := _memory_bytes(data)) > MEMORY_MAX_BYTES:
            raise ValueError(f"{bytes_text(needed)} once it is read")
        text = data.decode("utf-8-sig") if isinstance(data, bytes) else data
        value = json.loads(text, parse_constant=constant, parse_int=_integer, parse_float=_fraction)
        if _is_deeper(text, DEPTH_MAX):
            raise RecursionError
        return value
    except (ValueError, RecursionError) as problem:
        reason = "nested too deeply" if isinstance(problem, RecursionError) else str(problem)
        raise error.about(subject, found=f"no JSON ({reason[:120]})", allowed=allowed) from None


def _is_deeper(text: str, most: int) -> bool:
    """Whether lists and objects of a valid text hold each other deeper than so many."""
    if text.count("[") + text.count("{") <= most:
        return False
    left = re.sub(r"[^][{}]+", "", _TEXTS.sub("", text))
    for _ in range(most):
        if not left:
            return False
        left = left.replace("[]", "").replace("{}", "")
    return bool(left)


def _memory_bytes(data: bytes | str) -> int:
    """About what the lists, objects, keys, values and texts of a JSON text take at most."""
    if len(data) < MEMORY_MAX_BYTES // DICT_BYTES:  # so few that they cannot take more
        return 0
    signs: tuple[Any, ...] = (b"[", b"{", b":", b",", b'"')
    if isinstance(data, str):
        signs = ("[", "{", ":", ",", '"')
    lists, dicts, keys, items, quotes = (data.count(sign) for sign in signs)
    return (
        len(data)
        + lists * LIST_BYTES
        + dicts * DICT_BYTES
        + keys * KEY_BYTES
        + items * ITEM_BYTES
        + quotes // 2 * TEXT_BYTES
    )


def write_record(path: str | Path, record: Mapping[str, Any], *, indent: int | None = None) -> str:
    """Write a JSON object to a file, whole or not at all, and return its text.

    Raises OutputError where the file cannot be written, ValueError for NaN and infinity.
    """
    text = json.dumps(record, allow_nan=False, indent=indent)
    with write_atomically(path) as draft:
        draft.write_text(text + "\n", encoding="utf-8")
    return text


def finite_number(value: Any) -> float | None:
    """A value of JSON as a float; None for what is no finite number, truth values included."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def _refuse_constant(name: str) -> NoReturn:
    """Raise ValueError for NaN and the infinities."""
    raise ValueError(f"{name} is no number of JSON")


def _nan_alone(name: str) -> float:
    """NaN; raises ValueError for the infinities."""
    return math.nan if name == "NaN" else _refuse_constant(name)


def _integer(digits: str) -> int:
    """A whole number; raises ValueError for one of too many digits."""
    if len(digits) - digits.startswith("-") > INTEGER_MAX_DIGITS:
        raise ValueError(f"a whole number of {len(digits)} digits")
    return int(digits)


def _fraction(digits: str) -> float:
    """A finite fraction; raises ValueError for anything else."""
    number = float(digits)
    if not math.isfinite(number):
        raise ValueError(f"{digits[:40]} is beyond what a number holds")
    return number
