"""Changes a JSON text and leaves every other letter of it as it was.

A path names a value: keys of objects and places in lists, from the outermost inwards. The text
has been read before by `json_records`, so that it is known to be JSON.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any

Steps = Sequence[str | int]
_READER = json.JSONDecoder()
_BLANKS = " \t\r\n"


def find(text: str, path: Steps) -> tuple[int, int] | None:
    """Where a value stands.

    Parameters
    ----------
    text : str
        JSON.
    path : sequence of str and int
        Which value.

    Returns
    -------
    (int, int) or None
        Its first letter, and the one after its last; None where there is no such value.
    """
    at = _skipped(text, 0)
    place = (at, _READER.raw_decode(text, at)[1])
    for step in path:
        parts = _members(text, place[0]) if isinstance(step, str) else _items(text, place[0])
        # Of a key that occurs twice the last one counts, as for Python's reader.
        found = [(start, end) for name, start, end in parts if name == step]
        if not found:
            return None
        place = found[-1]
    return place


def with_value(text: str, path: Steps, value: Any) -> str:
    """The text with a value set.

    Parameters
    ----------
    text : str
        JSON.
    path : sequence of str and int
        Where to: a value that is there, or another key of an object that is.
    value : object
        Anything that JSON can hold.

    Returns
    -------
    str

    Raises
    ------
    KeyError
        Where nothing is there to hold it.
    """
    new = _written(value)
    place = find(text, path)
    if place is not None:
        return text[: place[0]] + new + text[place[1] :]
    holder = find(text, path[:-1])
    if holder is None or text[holder[0]] != "{" or not isinstance(path[-1], str):
        raise KeyError(path)
    return _inserted(text, holder, f"{json.dumps(path[-1])}:{new}")


def with_items(text: str, path: Steps, values: Sequence[Any]) -> str:
    """The text with items at the end of a list; one that is missing is made.

    Parameters
    ----------
    text : str
        JSON.
    path : sequence of str and int
        The list.
    values : sequence
        What JSON can hold.

    Returns
    -------
    str

    Raises
    ------
    KeyError
        Where nothing is there to hold the list.
    """
    place = find(text, path)
    if place is None:
        return with_value(text, path, list(values))
    return _inserted(text, place, ",".join(map(_written, values))) if values else text


def _before(text: str, at: int) -> int:
    """One past the last letter before `at` that is no blank."""
    while text[at - 1] in _BLANKS:
        at -= 1
    return at


def _inserted(text: str, holder: tuple[int, int], new: str) -> str:
    """The text with something last inside brackets."""
    last = holder[1] - 1
    end = _before(text, last)
    comma = "" if text[end - 1] in "[{" else ","
    return text[:end] + comma + new + text[end:]


def _written(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def _skipped(text: str, at: int) -> int:
    while text[at] in _BLANKS:
        at += 1
    return at


def _members(text: str, at: int) -> Iterator[tuple[str, int, int]]:
    """Keys of the object that begins at `at`, and where their values stand."""
    if text[at] != "{":
        return
    at = _skipped(text, at + 1)
    while text[at] != "}":
        name, at = _READER.raw_decode(text, at)
        start = _skipped(text, _skipped(text, at) + 1)
        end = _READER.raw_decode(text, start)[1]
        yield name, start, end
        at = _skipped(text, end)
        if text[at] == ",":
            at = _skipped(text, at + 1)


def _items(text: str, at: int) -> Iterator[tuple[int, int, int]]:
    """Places of the list that begins at `at`, and where their values stand."""
    if text[at] != "[":
        return
    at, place = _skipped(text, at + 1), 0
    while text[at] != "]":
        end = _READER.raw_decode(text, at)[1]
        yield place, at, end
        at, place = _skipped(text, end), place + 1
        if text[at] == ",":
            at = _skipped(text, at + 1)
