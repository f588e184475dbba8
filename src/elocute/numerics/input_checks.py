"""Checks what callers give before anything is computed or memory is taken."""

from __future__ import annotations

import math
import operator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError
from elocute.one_line_repr import brief

NUMBERS_MAX = 250_000_000
"""Numbers of one array that has to be copied: 1 GB of float32, 87 minutes of sound at 48 kHz,
20 hours of a face. An array may be given that takes no memory itself (np.broadcast_to, range)."""


def real_number(value: Any) -> float | None:
    """`value` as a float where it is one finite real number (no truth value), else None."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    kinds = int | float | np.integer | np.floating
    if isinstance(value, bool) or not isinstance(value, kinds):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def whole_number(value: Any) -> int | None:
    """`value` where it is one whole number (no truth value), else None."""
    if isinstance(value, bool | np.ndarray):
        return None
    try:
        return operator.index(value)
    except TypeError:
        return None


def array_of(
    value: Any,
    subject: str,
    *,
    error: type[InputError],
    allowed: str = "an array of numbers",
    most: int = NUMBERS_MAX,
) -> NDArray[Any]:
    """`value` as an array of whatever it holds; what has no even shape is one object.

    Raises `error` for more than `most` numbers, but for an array that holds them in one piece.
    """
    count = value.size if isinstance(value, np.ndarray) else count_of(value)
    too_long = count > most and not isinstance(value, np.ndarray)
    try:
        array: NDArray[Any] = np.zeros((), object) if too_long else np.asarray(value)
    except MemoryError:
        raise
    except Exception:  # lists of unequal length, or an `__array__` that fails
        array = np.zeros((), object)
    if too_long or (array.size > most and not array.flags.c_contiguous):
        raise error.about(
            subject, found=f"{count} numbers", allowed=f"{allowed}, up to {most} numbers"
        )
    return array


def floats_of(
    value: Any,
    subject: str,
    *,
    error: type[InputError],
    allowed: str,
    most: int = NUMBERS_MAX,
    dtype: type[np.floating] = np.float32,
) -> NDArray[Any]:
    """The same as floats in one piece: whole numbers and truth values are taken too.

    What is beyond a float becomes infinity. Raises `error` for text, objects and complex numbers.
    """
    array = array_of(value, subject, error=error, allowed=allowed, most=most)
    if array.dtype.kind not in "fiub":
        kind = array.dtype if array.ndim else type(value).__name__
        raise error.about(subject, found=f"numbers of type {kind}", allowed=allowed)
    if array.size > most and array.dtype != dtype:
        raise error.about(subject, found=f"{array.size} numbers", allowed=f"up to {most}")
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(array, dtype).reshape(array.shape)


def count_of(value: Any, depth: int = 4) -> int:
    """How many numbers a sequence holds, as far as can be told without going through it."""
    if isinstance(value, list | tuple) and depth:
        return sum(count_of(part, depth - 1) for part in value)
    if isinstance(value, np.ndarray):
        return value.size
    if isinstance(value, str | bytes) or not hasattr(value, "__len__"):
        return 1
    try:
        return len(value)
    except OverflowError:
        return 2**63
    except Exception:  # whatever the caller's `__len__` raises
        return 1


def check_kind(
    subject: str, value: object, kinds: Any, allowed: str, error: type[InputError] = InputError
) -> None:
    """Raise `error` where a value is not an instance of `kinds`."""
    if not isinstance(value, kinds):
        raise error.about(subject, found=brief(value), allowed=allowed)


def check_alone(**given: object) -> None:
    """Raise InputError where more than one of these arguments is not None."""
    names = [name for name, value in given.items() if value is not None]
    if len(names) > 1:
        raise InputError.about(f"`{names[0]}`", found=f"`{names[1]}` too", allowed="one of them")
