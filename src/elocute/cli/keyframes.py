"""Keyframes as text: `0:0,0,0; 1.5:0,20,0` (seconds: values)."""

from __future__ import annotations

import math

from elocute.errors import InputError

_WANTED = {1: "one finite number", 2: "two finite numbers: x,y", 3: "three finite numbers: x,y,z"}


def parse_numbers(option: str, text: str, count: int) -> list[tuple[float, list[float]]]:
    """Keyframes of `count` numbers each; without a time, one that holds. Raises InputError."""
    return [(time, _numbers(option, part, count)) for time, part in split_keyframes(option, text)]


def split_keyframes(option: str, text: str) -> list[tuple[float, str]]:
    """(seconds, text) of each `seconds:text`, separated by semicolons. Raises InputError."""
    parts = [part.strip() for part in text.split(";") if part.strip()]
    if len(parts) == 1 and ":" not in parts[0]:
        return [(0.0, parts[0])]
    return [_keyframe(option, part) for part in parts] or [_keyframe(option, text)]


def parse_list(option: str, text: str) -> list[float]:
    """Numbers separated by commas. Raises InputError."""
    return _numbers(option, text, None)


def _keyframe(option: str, part: str) -> tuple[float, str]:
    time, colon, value = part.partition(":")
    try:
        seconds = _number(time)
    except ValueError:
        seconds = math.nan
    if not colon or not value.strip() or not math.isfinite(seconds):
        raise InputError.about(
            option, found=repr(part[:60]), allowed="seconds:value; seconds:value; …"
        )
    return seconds, value.strip()


def _number(text: str) -> float:
    """As the options of one number take it: without the digits of other scripts."""
    if not text.isascii():
        raise ValueError(text)
    return float(text)


def _numbers(option: str, text: str, count: int | None) -> list[float]:
    try:
        numbers = [_number(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    wrong = not numbers or not all(math.isfinite(number) for number in numbers)
    if wrong or (count is not None and len(numbers) != count):
        allowed = "finite numbers separated by commas" if count is None else _WANTED[count]
        raise InputError.about(option, found=repr(text[:60]), allowed=allowed)
    return numbers
