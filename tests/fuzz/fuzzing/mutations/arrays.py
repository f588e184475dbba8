""".npy and .npz whose outer form holds: checksums are right, headers parse."""

from __future__ import annotations

import io
import re
import struct
import zipfile
import zlib
from functools import lru_cache
from random import Random

from tests.fuzz.fuzzing.mutations.any_bytes import (
    ANY,
    EDGES,
    cut_off,
    edge,
    flip,
    number,
    replace,
    zeros,
)
from tests.fuzz.fuzzing.mutations.json_text import json_changed
from tests.fuzz.fuzzing.mutations.text import token

SHAPES = (
    "()",
    "(0,)",
    "(1,)",
    "(0, 3)",
    "(3, 0)",
    "(1, 1)",
    "(2, 3)",
    "(-1,)",
    "(3,)",
    "(True,)",
    "(1.0,)",
    "(2**40,)",
    "(99999999999999999999,)",
    "(1, 1, 1, 1, 1, 1, 1, 1)",
    "[2, 3]",
    "(4294967296, 4294967296)",
    "(1000000, 1000000, 1000000)",
    "(0, 99999999999)",
    "(1,)*40",
    "(1, (2,))",
    "'3'",
    "None",
    f"({'1,' * 70})",
    "9" * 400,
)
TYPES = (
    "'<f4'",
    "'<f8'",
    "'>f8'",
    "'<f2'",
    "'|u1'",
    "'|i1'",
    "'<i8'",
    "'<u8'",
    "'|b1'",
    "'<c16'",
    "'|O'",
    "'<U4'",
    "'|S4'",
    "'<M8[s]'",
    "'<m8'",
    "'|V4'",
    "'<U0'",
    "'|S0'",
    "'<f16'",
    "'x'",
    "''",
    "'<U1000000000'",
    "[('a', '<f4')]",
    "[('a', '|O')]",
    "3",
    "None",
    "'<i4,<i4'",
    "'f'",
    "'('*500",
)


def npy(header: str, content: bytes) -> bytes:
    """A .npy whose header says whatever it is told."""
    text = header.encode("latin-1", "replace") + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text) % 65536) + text + content


def npy_header(rng: Random, data: bytes) -> bytes:
    header, content = _npy_parts(data)
    act = rng.randrange(5)
    if act == 0:
        header = re.sub(r"'shape': \(.*?\)", f"'shape': {rng.choice(SHAPES)}", header)
    elif act == 1:
        header = re.sub(r"'descr': ('.*?')", f"'descr': {rng.choice(TYPES)}", header)
    elif act == 2:
        header = header.replace("False", "True")
    elif act == 3:
        header = token(rng, header.encode()).decode("latin-1")
    else:  # what the header promises is there, but for another type
        shape = rng.choice(SHAPES[:9])
        return npy(
            f"{{'descr': {rng.choice(TYPES)}, 'fortran_order': False, 'shape': {shape}, }}",
            rng.choice((bytes(64), content, b"\xff" * 64)),
        )
    return npy(header, content)


def npy_numbers(rng: Random, data: bytes) -> bytes:
    header, content = _npy_parts(data)
    change = rng.choice((flip, number, edge, zeros, cut_off, replace))
    return npy(header, change(rng, content))


def _npy_json(rng: Random, data: bytes) -> bytes:
    """JSON stored as bytes or as text in an array, changed and stored again."""
    header, content = _npy_parts(data)
    if "'|u1'" in header:
        changed = json_changed(rng, content.decode()).encode("utf-8", "surrogatepass")
        return npy(re.sub(r"\(\d+,\)", f"({len(changed)},)", header), changed)
    found = re.search(r"'<U(\d+)'", header)
    if not found or "'shape': ()" not in header:
        raise ValueError("no text")
    text = json_changed(rng, content.decode("utf-32-le").rstrip("\0"))
    return npy(header.replace(found[0], f"'<U{len(text)}'"), text.encode("utf-32-le", "replace"))


def _npy_parts(data: bytes) -> tuple[str, bytes]:
    if data[:6] != b"\x93NUMPY" or data[6] != 1:
        raise ValueError("no .npy")
    (size,) = struct.unpack("<H", data[8:10])
    return data[10 : 10 + size].decode("latin-1").strip(), data[10 + size :]


def npz_entry(rng: Random, data: bytes) -> bytes:
    names, contents = _unzipped(data)
    at = rng.randrange(len(names))
    if rng.random() < 0.35:  # the records in JSON lie in few of many arrays
        told = [
            i for i, name in enumerate(names) if name in ("texts.npy", "record.npy", "words.npy")
        ]
        at = rng.choice(told) if told else at
    act = rng.random()
    if act < 0.75:
        change = rng.choice((npy_header, npy_header, npy_numbers, _npy_json, _npy_json))
        try:
            contents[at] = change(rng, contents[at])
        except ValueError:
            contents[at] = rng.choice((npy_header, npy_numbers))(rng, contents[at])
    elif act < 0.8:
        del names[at], contents[at]
    elif act < 0.85:
        names[at] = rng.choice(
            (
                names[at] + "x",
                "",
                "../a.npy",
                "a/b.npy",
                "fps.npy",
                "self.npy",
                "head/name.npy",
                "head/.npy",
                "region/.npy",
                "é.npy",
            )
        )
    elif act < 0.9:
        there = rng.randrange(len(names))
        contents[at], contents[there] = contents[there], contents[at]
    elif act < 0.95:
        names.append(names[at])
        contents.append(contents[rng.randrange(len(names) - 1)])
    else:
        contents[at] = rng.choice(ANY)(rng, contents[at])
    return _zipped(names, contents, rng.choice((0, 0, 0, 8)))


def npz_bomb(rng: Random, data: bytes) -> bytes:
    """An array far larger than the file, packed well."""
    names, contents = _unzipped(data)
    at = rng.randrange(len(names))
    count = rng.choice((300_000, 3_000_000, 30_000_000))
    shape = rng.choice((f"({count // 4},)", f"({count // 12}, 3)", f"(1, {count // 12}, 3)"))
    header = f"{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}"
    contents[at] = npy(header, bytes(count))
    return _zipped(names, contents, 8)


@lru_cache(64)
def _entries(data: bytes) -> tuple[tuple[str, bytes], ...]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        entries = archive.infolist()
        if sum(entry.file_size for entry in entries) > 50_000_000:
            raise ValueError("large already")
        return tuple((entry.filename, archive.read(entry)) for entry in entries)


def _unzipped(data: bytes) -> tuple[list[str], list[bytes]]:
    entries = _entries(data)
    return [name for name, _ in entries], [content for _, content in entries]


def _zipped(names: list[str], contents: list[bytes], method: int) -> bytes:
    """An archive whose checksums are right, names twice and all; ten times as fast as zipfile."""
    body, directory = bytearray(), bytearray()
    for name, content in zip(names, contents, strict=True):
        packed = content
        if method:
            packer = zlib.compressobj(1, zlib.DEFLATED, -15)
            packed = packer.compress(content) + packer.flush()
        called = name.encode()
        facts = struct.pack(
            "<HHHHHIIIHH",
            20,
            0x800,
            method,
            0,
            33,
            zlib.crc32(content),
            len(packed),
            len(content),
            len(called),
            0,
        )
        at = len(body)
        body += b"PK\x03\x04" + facts + called + packed
        directory += b"PK\x01\x02" + struct.pack("<H", 20) + facts
        directory += struct.pack("<HHHII", 0, 0, 0, 0, at) + called
    end = struct.pack("<HHHHIIH", 0, 0, len(names), len(names), len(directory), len(body), 0)
    return bytes(body + directory + b"PK\x05\x06" + end)


def zip_directory(rng: Random, data: bytes) -> bytes:
    """A field of the directory at the end, which says where and how large entries are."""
    at = data.rindex(b"PK\x01\x02") if rng.random() < 0.5 else data.rindex(b"PK\x05\x06")
    start, code = at + rng.randrange(4, 42), rng.choice(("<H", "<I"))
    value = rng.choice(EDGES) % 2 ** (8 * struct.calcsize(code))
    return data[:start] + struct.pack(code, value) + data[start + struct.calcsize(code) :]
