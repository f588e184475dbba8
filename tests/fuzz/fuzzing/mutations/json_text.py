"""JSON that stays JSON: one value or key is another."""

from __future__ import annotations

import json
import re
from random import Random

from tests.fuzz.fuzzing.mutations.text import NUMBERS

JSON_VALUES = (
    *NUMBERS[:30],
    "true",
    "false",
    "null",
    '""',
    '"a"',
    '"0"',
    "[]",
    "{}",
    "[[]]",
    '[""]',
    "[null]",
    "[1]",
    "[[1, 2, 3]]",
    "[1, [2]]",
    '{"a": 1}',
    '"\\ud800"',
    '"\\u0000"',
    '"../../x"',
    '"/etc/passwd"',
    '"a\\nb"',
    '"' + "x" * 5000 + '"',
    '"\\u202e"',
    "[" * 900 + "]" * 900,
    "[" * 100_000 + "]" * 100_000,
    '{"a":' * 2000 + "1" + "}" * 2000,
    "[" + "0," * 5000 + "0]",
    '"nan"',
    '"1"',
    "-5",
    "3",
    "1.0",
    "61",
    "1e3",
    '"NaN"',
)

_RAW = "\x01raw\x01"
_RAW_QUOTED = json.dumps(_RAW)


def json_value(rng: Random, data: bytes) -> bytes:
    return json_changed(rng, data.decode("utf-8-sig")).encode("utf-8", "surrogatepass")


def json_changed(rng: Random, text: str) -> str:
    """A JSON text in which one value or key is another."""
    root = [json.loads(text)]
    places: list[tuple[list | dict, int | str]] = []
    _collect(root, places, 4000)
    # Short paths first half of the time: fields of records matter more than the 900th number.
    container, key = rng.choice(places[: rng.choice((8, 40, len(places)))])
    raw = rng.choice(JSON_VALUES)
    act = rng.random()
    if act < 0.6:
        container[key] = _RAW  # type: ignore[index]
    elif act < 0.68 and container is not root:
        del container[key]  # type: ignore[arg-type]
    elif act < 0.76 and isinstance(container, dict):
        container[rng.choice(("", "a", "format", "x" * 300, "\ud800", "../x"))] = container.pop(key)
    elif act < 0.82:
        other, there = rng.choice(places)
        container[key], other[there] = other[there], container[key]  # type: ignore[index]
        if container[key] is container or _holds(container[key], container):  # type: ignore[index]
            container[key] = None  # type: ignore[index]
    elif act < 0.88 and isinstance(container, list):
        container[key:key] = [container[key]] * rng.choice((1, 2, 1000))  # type: ignore[index]
    elif act < 0.94:
        container[key] = [container[key]]  # type: ignore[index]
    elif isinstance(container, dict):
        container[rng.choice(("extra", "version", "__class__", "self"))] = _RAW
    else:
        container.append(_RAW)
    return json.dumps(root[0]).replace(_RAW_QUOTED, raw)


def _collect(value: object, places: list, most: int) -> None:
    """Containers and keys, nearest to the root first."""
    level: list[object] = [value]
    while level and len(places) < most:
        after: list[object] = []
        for each in level:
            items = (
                enumerate(each)
                if isinstance(each, list)
                else each.items()
                if isinstance(each, dict)
                else ()
            )
            for key, inner in items:
                places.append((each, key))
                after.append(inner)
        level = after


def _holds(value: object, wanted: object) -> bool:
    level = [value]
    while level:
        each = level.pop()
        if each is wanted:
            return True
        level += each if isinstance(each, list) else each.values() if isinstance(each, dict) else ()
    return False


def json_key_twice(rng: Random, data: bytes) -> bytes:
    text = data.decode("utf-8-sig")
    keys = re.findall(r'"[A-Za-z_0-9]+"\s*:', text)
    at = text.index("{") + 1
    return (text[:at] + rng.choice(keys) + rng.choice(JSON_VALUES) + "," + text[at:]).encode()
