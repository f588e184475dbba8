"""Frames as the Live Link Face app sends them to Unreal Engine (UDP, port 11111)."""

from __future__ import annotations

import struct
import uuid
from fractions import Fraction

from elocute.export.arkit_csv import POSE_COLUMNS
from elocute.live.live_frame import LiveFrame

VERSION, VALUES = 6, 61
SUBJECT = "Elocute"


class LiveLinkFace:
    """Packets of 52 curves and nine angles; each stream is a device of its own."""

    def __init__(self) -> None:
        device, subject = str(uuid.uuid4()).encode(), SUBJECT.encode()
        self._begin = struct.pack(f">Bi{len(device)}s", VERSION, len(device), device)
        self._begin += struct.pack(f">i{len(subject)}s", len(subject), subject)

    def packets(self, frame: LiveFrame) -> list[bytes]:
        """One packet. Eyes turn by curves alone."""
        rate = Fraction(frame.fps).limit_denominator(1001)
        still = len(POSE_COLUMNS) - len(frame.head_turns)
        values = [*frame.arkit.values(), *frame.head_turns, *[0.0] * still]
        times = struct.pack(">ifii", frame.number, 0.0, rate.numerator, rate.denominator)
        return [self._begin + times + struct.pack(f">B{VALUES}f", VALUES, *values)]
