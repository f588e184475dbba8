"""Pictures and sound: chunks, their sizes and their checksums."""

from __future__ import annotations

import re
import struct
import zlib
from random import Random

from tests.fuzz.fuzzing.mutations.any_bytes import EDGES, cut_off, double, edge, flip


def png(rng: Random, data: bytes) -> bytes:
    """A chunk's content, its checksum right again; or a picture far larger than its file."""
    chunks = []
    at = 8
    while at + 8 <= len(data):
        size, name = struct.unpack(">I4s", data[at : at + 8])
        chunks.append((name, data[at + 8 : at + 8 + size]))
        at += 12 + size
    if rng.random() < 0.2:
        width = rng.choice((0, 1, 5000, 20_000, 60_000, 2**31 - 1))
        height = rng.choice((0, 1, 5000, 20_000, 60_000))
        packed = zlib.compress(bytes(min(width * height, 4_000_000)), 1)
        head = struct.pack(">IIBBBBB", width, height, rng.choice((1, 8, 16)), 0, 0, 0, 0)
        chunks = [(b"IHDR", head), (b"IDAT", packed), (b"IEND", b"")]
    else:
        place = rng.randrange(len(chunks))
        name, content = chunks[place]
        act = rng.randrange(4)
        if act == 0:
            content = rng.choice((flip, edge, cut_off, double))(rng, content)
        elif act == 1 and name == b"IDAT":
            content = zlib.compress(flip(rng, zlib.decompress(content)) * rng.choice((1, 9)))
        elif act == 2:
            name = rng.choice((b"tEXt", b"zTXt", b"iCCP", b"PLTE", b"tRNS", b"acTL", b"eXIf"))
        else:
            chunks.insert(place, chunks[place])
        chunks[place] = name, content
    body = b"".join(
        struct.pack(">I", len(content))
        + name
        + content
        + struct.pack(">I", zlib.crc32(name + content))
        for name, content in chunks
    )
    return data[:8] + body


def riff(rng: Random, data: bytes) -> bytes:
    """A chunk's name, size or first field: codec, channels, rate."""
    names = (b"fmt ", b"data", b"ds64", b"fact", b"LIST", b"RIFF", b"WAVE", b"COMM", b"SSND")
    places = [m.start() for m in re.finditer(b"|".join(names), data[:4096])]
    at = rng.choice(places)
    act = rng.randrange(5)
    if act == 0:
        return data[:at] + rng.choice((*names, b"RF64", b"RIFX", b"junk", b"AIFC")) + data[at + 4 :]
    if act == 1:
        size = rng.choice((0, 1, 2, 15, 16, 18, 27, 28, 40, *EDGES)) % 2**32
        return data[: at + 4] + struct.pack("<I", size) + data[at + 8 :]
    if act == 2:
        tag = rng.choice((0, 1, 2, 3, 6, 7, 17, 85, 0x55AA, 0xFFFE, 0xFFFF, rng.randrange(65536)))
        return data[: at + 8] + struct.pack("<H", tag) + data[at + 10 :]
    if act == 3:
        start = at + 8 + rng.randrange(28)
        return data[:start] + struct.pack("<I", rng.choice(EDGES) % 2**32) + data[start + 4 :]
    size = rng.choice((0, 4, 28))
    return data[:at] + b"ds64" + struct.pack("<I", size) + rng.randbytes(size) + data[at:]
