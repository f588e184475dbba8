"""Open Sound Control 1.0: messages of numbers and texts, and bundles that fit a packet.

Written here, since a frame has sixty messages and is sent sixty times a second.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator

NOW = struct.pack(">Q", 1)
BUNDLE = b"#bundle\0" + NOW
PACKET_MAX = 1500
"""Bytes that a network passes on undivided."""


def message(address: str, *values: str | int | float) -> bytes:
    """A message; int and float are sent in 32 bits."""
    kinds, data = ",", b""
    for value in values:
        if isinstance(value, str):
            kinds, data = kinds + "s", data + _padded(value)
        elif isinstance(value, int):
            kinds, data = kinds + "i", data + struct.pack(">i", value)
        else:
            kinds, data = kinds + "f", data + struct.pack(">f", value)
    return _padded(address) + _padded(kinds) + data


def bundles(messages: Iterable[bytes]) -> Iterator[bytes]:
    """The messages in as few bundles as fit a packet each."""
    bundle = BUNDLE
    for each in messages:
        part = struct.pack(">i", len(each)) + each
        if len(bundle) + len(part) > PACKET_MAX and len(bundle) > len(BUNDLE):
            yield bundle
            bundle = BUNDLE
        bundle += part
    yield bundle


def _padded(text: str) -> bytes:
    data = text.encode() + b"\0"
    return data + b"\0" * (-len(data) % 4)
