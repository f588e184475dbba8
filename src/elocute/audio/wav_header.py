"""Reads the header of a RIFF/WAVE or RF64 file without trusting it."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from elocute.errors import AudioError

CHUNKS_MAX = 1000
UNKNOWN_FROM, LONG_UNKNOWN_FROM = 0x7FFF0000, 2**62
"""Sizes from which on a header does not know its size: writers to a pipe cannot go back to fill it
in."""
RIFF_MAX = 0xFFFFF000
FMT_MAX = 4096
NAMES = frozenset(
    (
        *(b"fmt ", b"data", b"fact", b"LIST", b"bext", b"iXML", b"cue ", b"smpl", b"inst", b"JUNK"),
        *(b"PAD ", b"id3 ", b"ID3 ", b"PEAK", b"cart", b"axml", b"chna", b"ds64", b"plst", b"_PMX"),
        *(b"acid", b"FLLR", b"levl", b"umid", b"minf", b"elm1", b"regn", b"junk"),
    )
)
"""Names that chunks of a WAVE file have."""


@dataclass(frozen=True)
class WavHeader:
    """What the header declares; promised_bytes is None where the writer did not know.

    orderly: every chunk lies within the file, and every part of a list within its list. plain:
    nothing stands before RIFF, and odd chunks are padded. format: the content of `fmt `; fact: that
    of `fact`, or nothing; data_at: where the sound begins. followers: further sounds behind it.
    """

    channels: int
    sample_rate: int
    promised_bytes: int | None
    present_bytes: int
    orderly: bool
    plain: bool
    format: bytes
    fact: bytes
    data_at: int
    followers: int = 0


def tag_bytes(file: BinaryIO) -> int:
    """How long the ID3 tag is that a file begins with; 0 for none. The position is lost."""
    file.seek(0)
    head = file.read(10)
    if head[:3] != b"ID3" or len(head) < 10:
        return 0
    size = 0
    for byte in head[6:]:
        size = size << 7 | byte & 0x7F
    return 10 + size


def read_wav_header(path: Path) -> WavHeader | None:
    """Format and size of the sound; None for a file that is not WAVE or ends before its sound."""
    total = path.stat().st_size
    with path.open("rb") as file:
        before = tag_bytes(file)
        file.seek(before)
        head = file.read(12)
        if head[:4] not in (b"RIFF", b"RF64") or head[8:] != b"WAVE":
            return None
        complete = before + struct.unpack("<I", head[4:8])[0] + 8 >= total
        fmt, fact, long_size, data_part = b"", b"", 0, None
        orderly, followers = True, 0
        plain = before == 0
        for name, size, padded in _chunks(file):
            end = file.tell() + size
            followers += name in (b"RIFF", b"RF64", b"data") and data_part is not None
            plain = plain and padded
            if name == b"ds64" and size >= 24:
                body = file.read(16)
                long_size = struct.unpack("<8xQ", body)[0] if len(body) == 16 else 0
            elif name == b"fmt " and size >= 16:
                fmt = file.read(min(size, FMT_MAX))
            elif name == b"fact":
                fact = file.read(min(size, 16))
            elif name == b"LIST":
                orderly = orderly and _list_is_orderly(file, min(end, total))
            elif name == b"data" and len(fmt) >= 16 and data_part is None:
                present = total - file.tell()
                data_part = _promised(size, long_size, present, complete), present, file.tell()
            orderly = orderly and (end <= total or name == b"data")
    if data_part is None:
        return None
    channels, rate = struct.unpack("<2xHI8x", fmt[:16])
    promised, present, start = data_part
    return WavHeader(channels, rate, promised, present, orderly, plain, fmt, fact, start, followers)


def _promised(size: int, long_size: int, present: int, complete: bool) -> int | None:
    """Bytes of sound; None where the writer did not know."""
    if long_size and size == 0xFFFFFFFF:
        return None if long_size > present and long_size >= LONG_UNKNOWN_FROM else long_size
    # No size at all means "up to the end", unless the file as a whole is accounted for.
    if size == 0 and present > 0 and not complete:
        return None
    return None if size > present and size >= UNKNOWN_FROM else size


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


def _chunks(file: BinaryIO) -> Iterator[tuple[bytes, int, bool]]:
    """Name and size of each chunk, with the file positioned at its content; whether it is padded.

    An odd chunk is without its padding where a chunk is seen to begin right behind it.
    """
    for _ in range(CHUNKS_MAX):
        head = file.read(8)
        if len(head) < 8:
            return
        name, size = struct.unpack("<4sI", head)
        start = file.tell()
        padding = size % 2
        if padding:
            file.seek(start + size)
            behind = file.read(5)
            padding = int(not (behind[:4] in NAMES and behind[1:] not in NAMES))
            file.seek(start)
        yield name, size, padding == size % 2
        file.seek(start + size + padding)


class WavPart(io.RawIOBase):
    """The sound of a WAVE file behind a header that says what is there, as a file to read.

    `header` is what was read of the file at `path`. Raises AudioError for a sound that is longer
    than such a header can say.
    """

    def __init__(self, path: Path, header: WavHeader) -> None:
        size = header.present_bytes
        if header.promised_bytes is not None:
            size = min(size, header.promised_bytes)
        (align,) = struct.unpack("<12xH", header.format[:14])
        self.frame_bytes = max(1, align)
        size -= size % self.frame_bytes
        if size > RIFF_MAX:
            raise AudioError.about(path, found="more than 4 GB of sound", allowed="up to 4 GB")
        chunks = _chunk(b"fmt ", header.format)
        chunks += _chunk(b"fact", header.fact) if header.fact else b""
        chunks += b"data" + struct.pack("<I", size)
        self._head = b"RIFF" + struct.pack("<I", 4 + len(chunks) + size) + b"WAVE" + chunks
        self._file = path.open("rb")
        self._start, self._size, self._place = header.data_at, size, 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._place

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        whole = len(self._head) + self._size
        self._place = max(0, offset + (0, self._place, whole)[whence])
        return self._place

    def readinto(self, buffer: memoryview | bytearray, /) -> int:  # type: ignore[override]
        into = memoryview(buffer).cast("B")
        if self._place < len(self._head):
            part = self._head[self._place : self._place + len(into)]
        else:
            done = self._place - len(self._head)
            self._file.seek(self._start + done)
            part = self._file.read(max(0, min(len(into), self._size - done)))
        into[: len(part)] = part
        self._place += len(part)
        return len(part)

    def close(self) -> None:
        self._file.close()
        super().close()


def _chunk(name: bytes, content: bytes) -> bytes:
    return name + struct.pack("<I", len(content)) + content + b"\0" * (len(content) % 2)
