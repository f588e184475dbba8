"""A .glb whose JSON or whose binary chunk is changed, with lengths that fit."""

from __future__ import annotations

import struct
from random import Random

from tests.fuzz.fuzzing.mutations.any_bytes import edge
from tests.fuzz.fuzzing.mutations.json_text import json_key_twice, json_value


def glb_json(rng: Random, data: bytes) -> bytes:
    text, rest = _parts(data)
    change = json_key_twice if rng.random() < 0.1 else json_value
    return _packed(change(rng, text), rest)


def glb_binary(rng: Random, data: bytes) -> bytes:
    text, rest = _parts(data)
    return _packed(text, edge(rng, rest) if rest else rest)


def _parts(data: bytes) -> tuple[bytes, bytes]:
    """The JSON, and the chunks after it. Raises struct.error and ValueError."""
    (length,) = struct.unpack_from("<I", data, 12)
    if data[16:20] != b"JSON":
        raise ValueError("no .glb")
    return data[20 : 20 + length], data[20 + length :]


def _packed(text: bytes, rest: bytes) -> bytes:
    text += b" " * (-len(text) % 4)
    total = 20 + len(text) + len(rest)
    return struct.pack("<4sIII4s", b"glTF", 2, total, len(text), b"JSON") + text + rest
