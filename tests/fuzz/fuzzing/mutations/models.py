"""Meshes, checkpoints and pickles."""

from __future__ import annotations

import struct
from random import Random

from tests.fuzz.fuzzing.mutations.json_text import json_changed
from tests.fuzz.fuzzing.mutations.text import lines, token


def header_text(rng: Random, data: bytes) -> bytes:
    """The text before the numbers of a .ply."""
    end = data.index(b"end_header")
    return rng.choice((token, lines))(rng, data[:end]) + data[end:]


def safetensors(rng: Random, data: bytes) -> bytes:
    (size,) = struct.unpack("<Q", data[:8])
    header = json_changed(rng, data[8 : 8 + size].decode()).encode("utf-8", "surrogatepass")
    return struct.pack("<Q", len(header)) + header + data[8 + size :]


def pickle(rng: Random, data: bytes) -> bytes:
    """An instruction is repeated, left out, moved or another."""
    import pickletools

    places: list[int] = []
    try:
        for _, _, at in pickletools.genops(data[:20_000]):
            places.append(at or 0)
    except Exception:  # cut off, or changed before: what was found so far
        pass
    if len(places) < 3:
        raise ValueError("no pickle")
    at = rng.randrange(len(places) - 1)
    start, stop = places[at], places[at + 1]
    act = rng.randrange(5)
    if act == 0:
        return data[:start] + data[stop:]
    if act == 1:
        return data[:stop] + data[start:stop] * rng.choice((1, 3, 1000)) + data[stop:]
    if act == 2:
        codes = b"(.0123FGIJKLMNPQRSTUVX]abcdehijloqrstu}\x80\x81\x85\x86\x87\x88\x8c\x8e\x93\x94"
        return data[:start] + bytes([rng.choice(codes)]) + data[start + 1 :]
    if act == 3:
        there = rng.randrange(len(places) - 1)
        return data[:start] + data[places[there] : places[there + 1]] + data[start:]
    value = rng.choice(
        (
            b"N",
            b"K\x00",
            b"J\xff\xff\xff\xff",
            b"]",
            b"}",
            b"(t",
            b"2",
            b"l\x01\x00",
            b"\x8a\x09" + b"\xff" * 8 + b"\x00",
            b"G\x7f\xf0" + bytes(6),
        )
    )
    return data[:start] + value + data[stop:]


def count(rng: Random, data: bytes) -> bytes:
    """Another count of vertices in a .vl, or other vertices than it counts."""
    if rng.random() < 0.5:
        return struct.pack("<i", rng.choice((0, 1, -1, 2**31 - 1, 357913941, 3))) + data[4:]
    return data[: 4 + 12 * rng.randrange(4)]
