"""Any bytes: flipped, cut, doubled, overwritten with numbers at the edge of their range."""

from __future__ import annotations

import struct
from collections.abc import Callable
from random import Random

Mutation = Callable[[Random, bytes], bytes]


EDGES = (
    0,
    1,
    2,
    127,
    128,
    255,
    256,
    2**15 - 1,
    2**15,
    2**16 - 1,
    2**24,
    2**31 - 1,
    2**31,
    2**32 - 2,
    2**32 - 1,
    2**53 + 1,
    2**63 - 1,
    2**63,
    2**64 - 1,
)


def place(rng: Random, data: bytes) -> int:
    """Mostly anywhere, often near the start, where headers are, or near the end."""
    if not data:
        return 0
    drawn = rng.random()
    if drawn < 0.3:
        return rng.randrange(min(len(data), 64))
    if drawn < 0.4:
        return len(data) - 1 - rng.randrange(min(len(data), 64))
    return rng.randrange(len(data))


def flip(rng: Random, data: bytes) -> bytes:
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8)) if out else 0):
        out[place(rng, data)] ^= 1 << rng.randrange(8)
    return bytes(out)


def replace(rng: Random, data: bytes) -> bytes:
    at, size = place(rng, data), rng.choice((1, 1, 2, 4, 16))
    return data[:at] + rng.randbytes(size) + data[at + size :]


def cut_off(rng: Random, data: bytes) -> bytes:
    return data[: place(rng, data)]


def cut_out(rng: Random, data: bytes) -> bytes:
    at = place(rng, data)
    return data[:at] + data[at + rng.choice((1, 2, 4, 8, 64, 1024)) :]


def double(rng: Random, data: bytes) -> bytes:
    at, size = place(rng, data), rng.choice((1, 4, 16, 256, 4096))
    return data[:at] + data[at : at + size] * rng.choice((2, 2, 3, 50)) + data[at + size :]


def edge(rng: Random, data: bytes) -> bytes:
    """An interesting integer of any size and order of bytes, over what stands there."""
    code = rng.choice(("<B", "<H", ">H", "<I", ">I", "<Q", ">Q"))
    size = struct.calcsize(code)
    value = rng.choice(EDGES) % 2 ** (8 * size)
    at = place(rng, data)
    return data[:at] + struct.pack(code, value) + data[at + size * rng.choice((0, 1, 1)) :]


def number(rng: Random, data: bytes) -> bytes:
    """NaN, infinity or a huge number where floats may stand."""
    code = rng.choice(("<f", "<d"))
    value = rng.choice((float("nan"), float("inf"), -float("inf"), 3e38, -3e38, 1e-40))
    at = place(rng, data) // 4 * 4
    return data[:at] + struct.pack(code, value) + data[at + struct.calcsize(code) :]


def zeros(rng: Random, data: bytes) -> bytes:
    at, size = place(rng, data), rng.choice((4, 64, 4096))
    return data[:at] + bytes(min(size, max(len(data) - at, 0))) + data[at + size :]


def spliced(rng: Random, data: bytes, other: bytes) -> bytes:
    return data[: place(rng, data)] + other[place(rng, other) :]


def _nothing(rng: Random, data: bytes) -> bytes:
    return rng.choice((b"", data[:1], data + data, data + bytes(100), rng.randbytes(64)))


ANY: tuple[Mutation, ...] = (
    flip,
    flip,
    flip,
    replace,
    replace,
    cut_off,
    cut_out,
    double,
    edge,
    edge,
    edge,
    number,
    zeros,
    _nothing,
)
