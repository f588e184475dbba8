"""The header of a RIFF/WAVE file, read without trusting it."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

UNKNOWN_SIZES = (0, 0xFFFFFFFF, 0x7FFFFFFF, 0x7FFFF000)  # what writers to a pipe leave behind
CHUNKS_MAX = 1000


@dataclass(frozen=True)
class WavHeader:
    """promised_bytes is None where the writer did not know."""

    channels: int
    sample_rate: int
    frame_bytes: int
    promised_bytes: int | None
    present_bytes: int


def read_wav_header(path: Path) -> WavHeader | None:
    """The format and the size of the sound; None for what is no RIFF/WAVE or has no data."""
    total = path.stat().st_size
    with path.open("rb") as file:
        if file.read(12)[:4] != b"RIFF":
            return None
        fmt = None
        for _ in range(CHUNKS_MAX):
            head = file.read(8)
            if len(head) < 8:
                return None
            name, size = struct.unpack("<4sI", head)
            if name == b"fmt ":
                body = file.read(min(size, 64))
                if len(body) < 16:
                    return None
                fmt = struct.unpack("<HHIIHH", body[:16])
                file.seek(size - len(body) + size % 2, 1)
            elif name == b"data":
                present = total - file.tell()
                if fmt is None:
                    return None
                unknown = size in UNKNOWN_SIZES and present > 0
                return WavHeader(fmt[1], fmt[2], fmt[4], None if unknown else size, present)
            else:
                file.seek(size + size % 2, 1)
    return None
