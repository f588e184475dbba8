"""The header of a RIFF/WAVE or RF64 file, read without trusting it."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

CHUNKS_MAX = 1000
# What writers to a pipe leave behind, who cannot go back to fill in the size.
UNKNOWN_SIZES = (0xFFFFFFFF, 0x7FFFFFFF, 0x7FFFF000)


@dataclass(frozen=True)
class WavHeader:
    """What the header declares; promised_bytes is None where the writer did not know.

    orderly: every chunk lies within the file, and every part of a list within its list.
    """

    channels: int
    sample_rate: int
    promised_bytes: int | None
    present_bytes: int
    orderly: bool


def read_wav_header(path: Path) -> WavHeader | None:
    """Format and size of the sound; None for a file that is not WAVE or ends before its sound."""
    total = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(12)
        if head[:4] not in (b"RIFF", b"RF64") or head[8:] != b"WAVE":
            return None
        complete = struct.unpack("<I", head[4:8])[0] + 8 >= total
        fmt = long_size = found = None
        orderly = True
        for name, size in _chunks(file):
            end = file.tell() + size
            if name == b"ds64" and size >= 24:
                body = file.read(16)
                long_size = struct.unpack("<8xQ", body)[0] if len(body) == 16 else None
            elif name == b"fmt ":
                body = file.read(16)
                fmt = struct.unpack("<2xHI8x", body) if len(body) == 16 else None
            elif name == b"LIST":
                orderly = orderly and _list_is_orderly(file, min(end, total))
            elif name == b"data" and fmt and found is None:
                present = total - file.tell()
                promised = long_size if long_size and size == 0xFFFFFFFF else size
                # No size at all means "up to the end", unless the file as a whole is accounted for.
                unknown = promised == 0 and present > 0 and not complete
                if unknown or (promised in UNKNOWN_SIZES and not long_size):
                    promised = None
                found = fmt[0], fmt[1], promised, present
            orderly = orderly and (end <= total or name == b"data")
    return WavHeader(*found, orderly) if found else None


def _list_is_orderly(file: BinaryIO, end: int) -> bool:
    file.seek(4, 1)
    for _ in range(CHUNKS_MAX):
        if file.tell() + 8 > end:
            return True
        (size,) = struct.unpack("<4xI", file.read(8))
        file.seek(size + size % 2, 1)
        if file.tell() > end + 1:
            return False
    return False


def _chunks(file: BinaryIO):
    """Name and size of each chunk, with the file positioned at its content."""
    for _ in range(CHUNKS_MAX):
        head = file.read(8)
        if len(head) < 8:
            return
        name, size = struct.unpack("<4sI", head)
        start = file.tell()
        yield name, size
        file.seek(start + size + size % 2)
