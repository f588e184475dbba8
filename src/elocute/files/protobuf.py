"""The wire format of protocol buffers: enough to read a graph as data and to write another one.

A message is a sequence of fields, each a key (number · 8 + wire type) and a value: a varint, four
or eight bytes, or a length and that many bytes. Source: protobuf.dev/programming-guides/encoding.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

VARINT, EIGHT_BYTES, BYTES, FOUR_BYTES = 0, 1, 2, 5
FIXED_SIZES = {EIGHT_BYTES: 8, FOUR_BYTES: 4}

Value = int | memoryview


def read_fields(message: memoryview, most: int) -> Iterator[tuple[int, int, Value]]:
    """Read the fields of a message, `most` of them: number, wire type and value; nothing is copied.

    A value is an int for a varint, else a view of its bytes. Raises ValueError where the bytes are
    not a message, end early, or hold more fields.
    """
    at = 0
    for _ in range(most):
        if at == len(message):
            return
        key, at = _varint(message, at)
        number, wire_type = key >> 3, key & 7
        if wire_type == VARINT:
            value, at = _varint(message, at)
            yield number, wire_type, value
            continue
        if wire_type == BYTES:
            size, at = _varint(message, at)
        elif wire_type in FIXED_SIZES:
            size = FIXED_SIZES[wire_type]
        else:
            raise ValueError(f"wire type {wire_type}")
        if not number or size > len(message) - at:
            raise ValueError("it ends early" if number else "field number 0")
        yield number, wire_type, message[at : at + size]
        at += size
    if at != len(message):
        raise ValueError(f"more than {most} fields in one message")


def read_varints(packed: memoryview) -> list[int]:
    """Read a packed list of unsigned integers; raises ValueError where it ends early."""
    values, at = [], 0
    while at < len(packed):
        value, at = _varint(packed, at)
        values.append(value)
    return values


def _varint(message: memoryview, at: int) -> tuple[int, int]:
    """The unsigned integer at `at`, seven bits a byte, least first; and where the next begins."""
    if at < len(message) and message[at] < 128:  # nearly all of them
        return message[at], at + 1
    value = 0
    for place in range(10):
        if at + place >= len(message):
            raise ValueError("it ends early")
        byte = message[at + place]
        value |= (byte & 127) << (7 * place)
        if byte < 128:
            return value, at + place + 1
    raise ValueError("a number of more than ten bytes")


def varint(value: int) -> bytes:
    """An unsigned integer, seven bits a byte, least first."""
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    out.append(value)
    return bytes(out)


def write_field(number: int, value: int | float | str | bytes) -> bytes:
    """One field of a message: an int becomes a varint, a float four bytes.

    Text and messages have their length before them.
    """
    if isinstance(value, int):
        return varint(number << 3 | VARINT) + varint(value)
    if isinstance(value, float):
        return varint(number << 3 | FOUR_BYTES) + struct.pack("<f", value)
    content = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | BYTES) + varint(len(content)) + content


def write_message(*fields: tuple[int, int | float | str | bytes]) -> bytes:
    """A message of fields, (number, value); a number that occurs again is a repeated entry."""
    return b"".join(write_field(number, value) for number, value in fields)
