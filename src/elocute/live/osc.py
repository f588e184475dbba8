"""Open Sound Control 1.0, and frames as plain messages of it (UDP, port 9000).

It is written here, since a frame has sixty messages and is sent sixty times a second.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator

from elocute.live.live_frame import LiveFrame

NOW = struct.pack(">Q", 1)
BUNDLE = b"#bundle\0" + NOW
PACKET_MAX = 1500
"""Bytes that a network passes on undivided."""


class Osc:
    """Bundles with a message for each of ARKit's curves, /elocute/jawOpen and a float."""

    def packets(self, frame: LiveFrame) -> list[bytes]:
        """Bundles of at most 1500 bytes, which begin with the frame's number and time."""
        yaw, pitch, roll = (180 * frame.head_turns).tolist()
        messages = [
            message("/elocute/frame", frame.number, float(frame.frame.time_s)),
            message("/elocute/head", yaw, pitch, roll),
            *(message(f"/elocute/{name}", value) for name, value in frame.arkit.items()),
        ]
        return list(bundles(messages))


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
