"""Protocol buffers whose lengths fit."""

from __future__ import annotations

from random import Random

from tests.fuzz.fuzzing.mutations.any_bytes import (
    EDGES,
    cut_off,
    double,
    edge,
    flip,
    number,
    replace,
)
from tests.fuzz.fuzzing.mutations.text import token


def proto(rng: Random, data: bytes) -> bytes:
    """One field, however deep, is changed; lengths around it are written anew."""
    fields = _proto_fields(data)
    if not fields:
        raise ValueError("no fields")
    at = rng.randrange(len(fields))
    field, wire, value = fields[at]
    act = rng.random()
    if wire == 2 and act < 0.75 and value:
        assert isinstance(value, bytes)
        try:
            fields[at] = field, wire, proto(rng, value)
        except ValueError:
            change = rng.choice((flip, edge, cut_off, double, replace, number, token))
            fields[at] = field, wire, change(rng, value)
    elif wire == 0 and act < 0.75:
        fields[at] = field, wire, rng.choice(EDGES)
    elif act < 0.8:
        fields[at] = rng.choice((0, 1, 2, 3, 5, 8, 13, 14, 20, 2**28)), wire, value
    elif act < 0.88:
        del fields[at]
    elif act < 0.95:
        fields[at:at] = [fields[at]] * rng.choice((1, 1, 200))
    else:
        there = rng.randrange(len(fields))
        fields[at], fields[there] = fields[there], fields[at]
    return b"".join(_proto_field(*field) for field in fields)


def _proto_fields(data: bytes) -> list[tuple[int, int, int | bytes]]:
    fields: list[tuple[int, int, int | bytes]] = []
    at = 0
    while at < len(data):
        key, at = _varint(data, at)
        number, wire = key >> 3, key & 7
        if not 0 < number < 2**12 or len(fields) > 3000:
            raise ValueError("no message")
        if wire == 0:
            value: int | bytes
            value, at = _varint(data, at)
        elif wire in (1, 2, 5):
            size, at = (8, at) if wire == 1 else (4, at) if wire == 5 else _varint(data, at)
            if size > len(data) - at:
                raise ValueError("it ends early")
            value, at = data[at : at + size], at + size
        else:
            raise ValueError("no wire type")
        fields.append((number, wire, value))
    return fields


def _proto_field(number: int, wire: int, value: int | bytes) -> bytes:
    head = _varint_bytes(number << 3 | wire)
    if isinstance(value, int):
        return head + _varint_bytes(value)
    return head + (_varint_bytes(len(value)) if wire == 2 else b"") + value


def _varint(data: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = data[at]
        value |= (byte & 127) << shift
        at, shift = at + 1, shift + 7
        if byte < 128:
            return value, at
        if shift > 63:
            raise ValueError("no number")


def _varint_bytes(value: int) -> bytes:
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes([*out, value])
