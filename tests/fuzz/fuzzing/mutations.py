"""Changed bytes, drawn by a random.Random: the same seed always gives the same bytes.

Every kind of file has mutations that keep its outer form, so that what lies inside is reached:
JSON stays JSON, an archive's checksums stay right, a protocol buffer's lengths fit.
"""

from __future__ import annotations

import io
import json
import re
import struct
import zipfile
import zlib
from collections.abc import Callable
from functools import lru_cache
from random import Random

Mutation = Callable[[Random, bytes], bytes]

GROWN_MOST = 1_000_000  # bytes: a large file may cost much, a small one may not
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
NUMBERS = (
    "0",
    "-0",
    "-1",
    "1",
    "2",
    "0.5",
    "1e-320",
    "5e-324",
    "1e300",
    "-1e300",
    "1e308",
    "1e400",
    "-1e400",
    "NaN",
    "Infinity",
    "-Infinity",
    "nan",
    "inf",
    "2147483648",
    "-2147483649",
    "4294967296",
    "9223372036854775807",
    "9223372036854775808",
    "18446744073709551616",
    "999999999999999999",
    "1" * 19,
    "9" * 400,
    "-" + "9" * 400,
    "9" * 5000,
    "0." + "1" * 400,
    "0x10",
    "1_000",
    "１２",
    "²",
    "1,5",
    "1e5",
    "+1",
    "--1",
    "1e",
    ".",
    "1e9999999999",
)
JSON_VALUES = (
    *NUMBERS[:30],
    "true",
    "false",
    "null",
    '""',
    '"a"',
    '"0"',
    "[]",
    "{}",
    "[[]]",
    '[""]',
    "[null]",
    "[1]",
    "[[1, 2, 3]]",
    "[1, [2]]",
    '{"a": 1}',
    '"\\ud800"',
    '"\\u0000"',
    '"../../x"',
    '"/etc/passwd"',
    '"a\\nb"',
    '"' + "x" * 5000 + '"',
    '"\\u202e"',
    "[" * 900 + "]" * 900,
    "[" * 100_000 + "]" * 100_000,
    '{"a":' * 2000 + "1" + "}" * 2000,
    "[" + "0," * 5000 + "0]",
    '"nan"',
    '"1"',
    "-5",
    "3",
    "1.0",
    "61",
    "1e3",
    '"NaN"',
)
WORDS = (
    *NUMBERS,
    "",
    " ",
    '"',
    '""',
    "'",
    ",",
    ";",
    ":",
    "\t",
    "\n",
    "\r",
    "\r\n",
    "\0",
    "\x1a",
    "\ufeff",
    "\u202e",
    "\u2028",
    "../../x",
    "/etc/passwd",
    "/dev/zero",
    "file:///etc/passwd",
    "a" * 5000,
    "%s%n",
    "{}",
    "[]",
    "true",
    "null",
    "é",
    "\U0001f600",
    "=1+1",
    "-",
    "#",
    "{",
    "}",
    "1 2 3",
    "1/1/1",
    "0/0/0",
    "-1//-1",
    "\\",
    "\x0b",
    "\x85",
)
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


def mutate(rng: Random, data: bytes, kind: str, others: tuple[bytes, ...] = ()) -> bytes:
    """One to three mutations of `data`, half of them such as its kind has, half of any bytes.

    `others` are seeds of the same kind, for splices.
    """
    special = KINDS[kind]
    most = 4 * len(data) + GROWN_MOST
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        if special and rng.random() < 0.7:
            try:
                data = rng.choice(special)(rng, data)[:most]
                continue
            except Exception:
                pass  # changed so much that its form is lost: any bytes, then
        if others and rng.random() < 0.1:
            data = _spliced(rng, data, rng.choice(others))
        else:
            data = rng.choice(_ANY)(rng, data)[:most]
    return data


# Any bytes.


def _place(rng: Random, data: bytes) -> int:
    """Mostly anywhere, often near the start, where headers are, or near the end."""
    if not data:
        return 0
    drawn = rng.random()
    if drawn < 0.3:
        return rng.randrange(min(len(data), 64))
    if drawn < 0.4:
        return len(data) - 1 - rng.randrange(min(len(data), 64))
    return rng.randrange(len(data))


def _flip(rng: Random, data: bytes) -> bytes:
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8)) if out else 0):
        out[_place(rng, data)] ^= 1 << rng.randrange(8)
    return bytes(out)


def _replace(rng: Random, data: bytes) -> bytes:
    at, size = _place(rng, data), rng.choice((1, 1, 2, 4, 16))
    return data[:at] + rng.randbytes(size) + data[at + size :]


def _cut_off(rng: Random, data: bytes) -> bytes:
    return data[: _place(rng, data)]


def _cut_out(rng: Random, data: bytes) -> bytes:
    at = _place(rng, data)
    return data[:at] + data[at + rng.choice((1, 2, 4, 8, 64, 1024)) :]


def _double(rng: Random, data: bytes) -> bytes:
    at, size = _place(rng, data), rng.choice((1, 4, 16, 256, 4096))
    return data[:at] + data[at : at + size] * rng.choice((2, 2, 3, 50)) + data[at + size :]


def _edge(rng: Random, data: bytes) -> bytes:
    """An interesting integer of any size and order of bytes, over what stands there."""
    code = rng.choice(("<B", "<H", ">H", "<I", ">I", "<Q", ">Q"))
    size = struct.calcsize(code)
    value = rng.choice(EDGES) % 2 ** (8 * size)
    at = _place(rng, data)
    return data[:at] + struct.pack(code, value) + data[at + size * rng.choice((0, 1, 1)) :]


def _number(rng: Random, data: bytes) -> bytes:
    """NaN, infinity or a huge number where floats may stand."""
    code = rng.choice(("<f", "<d"))
    value = rng.choice((float("nan"), float("inf"), -float("inf"), 3e38, -3e38, 1e-40))
    at = _place(rng, data) // 4 * 4
    return data[:at] + struct.pack(code, value) + data[at + struct.calcsize(code) :]


def _zeros(rng: Random, data: bytes) -> bytes:
    at, size = _place(rng, data), rng.choice((4, 64, 4096))
    return data[:at] + bytes(min(size, max(len(data) - at, 0))) + data[at + size :]


def _spliced(rng: Random, data: bytes, other: bytes) -> bytes:
    return data[: _place(rng, data)] + other[_place(rng, other) :]


def _nothing(rng: Random, data: bytes) -> bytes:
    return rng.choice((b"", data[:1], data + data, data + bytes(100), rng.randbytes(64)))


_ANY: tuple[Mutation, ...] = (
    _flip,
    _flip,
    _flip,
    _replace,
    _replace,
    _cut_off,
    _cut_out,
    _double,
    _edge,
    _edge,
    _edge,
    _number,
    _zeros,
    _nothing,
)


# JSON.

_RAW = "\x01raw\x01"
_RAW_QUOTED = json.dumps(_RAW)


def _json(rng: Random, data: bytes) -> bytes:
    return json_changed(rng, data.decode("utf-8-sig")).encode("utf-8", "surrogatepass")


def json_changed(rng: Random, text: str) -> str:
    """A JSON text in which one value or key is another."""
    root = [json.loads(text)]
    places: list[tuple[list | dict, int | str]] = []
    _collect(root, places, 4000)
    # Short paths first half of the time: fields of records matter more than the 900th number.
    container, key = rng.choice(places[: rng.choice((8, 40, len(places)))])
    raw = rng.choice(JSON_VALUES)
    act = rng.random()
    if act < 0.6:
        container[key] = _RAW  # type: ignore[index]
    elif act < 0.68 and container is not root:
        del container[key]  # type: ignore[arg-type]
    elif act < 0.76 and isinstance(container, dict):
        container[rng.choice(("", "a", "format", "x" * 300, "\ud800", "../x"))] = container.pop(key)
    elif act < 0.82:
        other, there = rng.choice(places)
        container[key], other[there] = other[there], container[key]  # type: ignore[index]
        if container[key] is container or _holds(container[key], container):  # type: ignore[index]
            container[key] = None  # type: ignore[index]
    elif act < 0.88 and isinstance(container, list):
        container[key:key] = [container[key]] * rng.choice((1, 2, 1000))  # type: ignore[index]
    elif act < 0.94:
        container[key] = [container[key]]  # type: ignore[index]
    elif isinstance(container, dict):
        container[rng.choice(("extra", "version", "__class__", "self"))] = _RAW
    else:
        container.append(_RAW)
    return json.dumps(root[0]).replace(_RAW_QUOTED, raw)


def _collect(value: object, places: list, most: int) -> None:
    """Containers and keys, nearest to the root first."""
    level: list[object] = [value]
    while level and len(places) < most:
        after: list[object] = []
        for each in level:
            items = (
                enumerate(each)
                if isinstance(each, list)
                else each.items()
                if isinstance(each, dict)
                else ()
            )
            for key, inner in items:
                places.append((each, key))
                after.append(inner)
        level = after


def _holds(value: object, wanted: object) -> bool:
    level = [value]
    while level:
        each = level.pop()
        if each is wanted:
            return True
        level += each if isinstance(each, list) else each.values() if isinstance(each, dict) else ()
    return False


def _json_key_twice(rng: Random, data: bytes) -> bytes:
    text = data.decode("utf-8-sig")
    keys = re.findall(r'"[A-Za-z_0-9]+"\s*:', text)
    at = text.index("{") + 1
    return (text[:at] + rng.choice(keys) + rng.choice(JSON_VALUES) + "," + text[at:]).encode()


# Text: CSV, OBJ, headers, options.

_TOKEN = re.compile(rb"[^\s,;:={}\"<>/]+")


def _token(rng: Random, data: bytes) -> bytes:
    tokens = list(_TOKEN.finditer(data, 0, 65536))
    one = rng.choice(tokens)
    word = rng.choice(WORDS).encode()
    if rng.random() < 0.1:
        word = bytes(rng.choice(([0xFF], [0xC3, 0x28], [0xED, 0xA0, 0x80], [0])))
    return data[: one.start()] + word + data[one.end() :]


def _lines(rng: Random, data: bytes) -> bytes:
    lines = data.split(b"\n")
    at = rng.randrange(min(len(lines), 200))
    act = rng.randrange(6)
    if act == 0:
        del lines[at]
    elif act == 1:
        lines[at:at] = [lines[at]] * rng.choice((1, 1, 100))
    elif act == 2:
        there = rng.randrange(len(lines))
        lines[at], lines[there] = lines[there], lines[at]
    elif act == 3:
        lines[at] = lines[at] * rng.choice((2, 50))
    elif act == 4:
        lines[at] = b""
    else:
        return rng.choice((b"\r", b"\r\n", b"\n\n", b"\0")).join(lines)
    return b"\n".join(lines)


def _encoding(rng: Random, data: bytes) -> bytes:
    text = data.decode("utf-8", "replace")
    code = rng.choice(("utf-16", "utf-16-be", "utf-8-sig", "utf-32", "latin-1"))
    return text.encode(code, "replace")


# .npy and .npz.


def npy(header: str, content: bytes) -> bytes:
    """A .npy whose header says whatever it is told."""
    text = header.encode("latin-1", "replace") + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text) % 65536) + text + content


def _npy_header(rng: Random, data: bytes) -> bytes:
    header, content = _npy_parts(data)
    act = rng.randrange(5)
    if act == 0:
        header = re.sub(r"'shape': \(.*?\)", f"'shape': {rng.choice(SHAPES)}", header)
    elif act == 1:
        header = re.sub(r"'descr': ('.*?')", f"'descr': {rng.choice(TYPES)}", header)
    elif act == 2:
        header = header.replace("False", "True")
    elif act == 3:
        header = _token(rng, header.encode()).decode("latin-1")
    else:  # what the header promises is there, but for another type
        shape = rng.choice(SHAPES[:9])
        return npy(
            f"{{'descr': {rng.choice(TYPES)}, 'fortran_order': False, 'shape': {shape}, }}",
            rng.choice((bytes(64), content, b"\xff" * 64)),
        )
    return npy(header, content)


def _npy_numbers(rng: Random, data: bytes) -> bytes:
    header, content = _npy_parts(data)
    change = rng.choice((_flip, _number, _edge, _zeros, _cut_off, _replace))
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


def _npz_entry(rng: Random, data: bytes) -> bytes:
    names, contents = _unzipped(data)
    at = rng.randrange(len(names))
    if rng.random() < 0.35:  # the records in JSON lie in few of many arrays
        told = [
            i for i, name in enumerate(names) if name in ("texts.npy", "record.npy", "words.npy")
        ]
        at = rng.choice(told) if told else at
    act = rng.random()
    if act < 0.75:
        change = rng.choice((_npy_header, _npy_header, _npy_numbers, _npy_json, _npy_json))
        try:
            contents[at] = change(rng, contents[at])
        except ValueError:
            contents[at] = rng.choice((_npy_header, _npy_numbers))(rng, contents[at])
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
        contents[at] = rng.choice(_ANY)(rng, contents[at])
    return _zipped(names, contents, rng.choice((0, 0, 0, 8)))


def _npz_bomb(rng: Random, data: bytes) -> bytes:
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


def _zip_directory(rng: Random, data: bytes) -> bytes:
    """A field of the directory at the end, which says where and how large entries are."""
    at = data.rindex(b"PK\x01\x02") if rng.random() < 0.5 else data.rindex(b"PK\x05\x06")
    start, code = at + rng.randrange(4, 42), rng.choice(("<H", "<I"))
    value = rng.choice(EDGES) % 2 ** (8 * struct.calcsize(code))
    return data[:start] + struct.pack(code, value) + data[start + struct.calcsize(code) :]


# Protocol buffers.


def _proto(rng: Random, data: bytes) -> bytes:
    """One field, however deep, is changed; lengths around it are written anew."""
    fields = _proto_fields(data)
    if not fields:
        raise ValueError("no fields")
    at = rng.randrange(len(fields))
    number, wire, value = fields[at]
    act = rng.random()
    if wire == 2 and act < 0.75 and value:
        assert isinstance(value, bytes)
        try:
            fields[at] = number, wire, _proto(rng, value)
        except ValueError:
            change = rng.choice((_flip, _edge, _cut_off, _double, _replace, _number, _token))
            fields[at] = number, wire, change(rng, value)
    elif wire == 0 and act < 0.75:
        fields[at] = number, wire, rng.choice(EDGES)
    elif act < 0.8:
        fields[at] = rng.choice((0, 1, 2, 3, 5, 8, 13, 14, 20, 2**28)), wire, value
    elif act < 0.88:
        del fields[at]
    elif act < 0.95:
        fields[at:at] = [fields[at]] * rng.choice((1, 1, 200))
    else:
        there = rng.randrange(len(fields))
        fields[at], fields[there] = fields[there], fields[at]
    return b"".join(_proto_field(*field) for field in fields)


def _proto_fields(data: bytes) -> list[tuple[int, int, int | bytes]]:
    fields: list[tuple[int, int, int | bytes]] = []
    at = 0
    while at < len(data):
        key, at = _varint(data, at)
        number, wire = key >> 3, key & 7
        if not 0 < number < 2**12 or len(fields) > 3000:
            raise ValueError("no message")
        if wire == 0:
            value: int | bytes
            value, at = _varint(data, at)
        elif wire in (1, 2, 5):
            size, at = (8, at) if wire == 1 else (4, at) if wire == 5 else _varint(data, at)
            if size > len(data) - at:
                raise ValueError("it ends early")
            value, at = data[at : at + size], at + size
        else:
            raise ValueError("no wire type")
        fields.append((number, wire, value))
    return fields


def _proto_field(number: int, wire: int, value: int | bytes) -> bytes:
    head = _varint_bytes(number << 3 | wire)
    if isinstance(value, int):
        return head + _varint_bytes(value)
    return head + (_varint_bytes(len(value)) if wire == 2 else b"") + value


def _varint(data: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = data[at]
        value |= (byte & 127) << shift
        at, shift = at + 1, shift + 7
        if byte < 128:
            return value, at
        if shift > 63:
            raise ValueError("no number")


def _varint_bytes(value: int) -> bytes:
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes([*out, value])


# Pictures, sound, meshes, checkpoints, pickles.


def _png(rng: Random, data: bytes) -> bytes:
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
            content = rng.choice((_flip, _edge, _cut_off, _double))(rng, content)
        elif act == 1 and name == b"IDAT":
            content = zlib.compress(_flip(rng, zlib.decompress(content)) * rng.choice((1, 9)))
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


def _riff(rng: Random, data: bytes) -> bytes:
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


def _header_text(rng: Random, data: bytes) -> bytes:
    """The text before the numbers of a .ply."""
    end = data.index(b"end_header")
    return rng.choice((_token, _lines))(rng, data[:end]) + data[end:]


def _safetensors(rng: Random, data: bytes) -> bytes:
    (size,) = struct.unpack("<Q", data[:8])
    header = json_changed(rng, data[8 : 8 + size].decode()).encode("utf-8", "surrogatepass")
    return struct.pack("<Q", len(header)) + header + data[8 + size :]


def _pickle(rng: Random, data: bytes) -> bytes:
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


def _count(rng: Random, data: bytes) -> bytes:
    """Another count of vertices in a .vl, or other vertices than it counts."""
    if rng.random() < 0.5:
        return struct.pack("<i", rng.choice((0, 1, -1, 2**31 - 1, 357913941, 3))) + data[4:]
    return data[: 4 + 12 * rng.randrange(4)]


KINDS: dict[str, tuple[Mutation, ...]] = {
    "bytes": (),
    "json": (_json, _json, _json, _json, _json_key_twice, _token, _encoding),
    "text": (_token, _token, _token, _lines, _encoding),
    "npy": (_npy_header, _npy_header, _npy_numbers),
    "npz": (_npz_entry,) * 60 + (_zip_directory,) * 9 + (_npz_bomb,),
    "proto": (_proto,),
    "png": (_png,),
    "riff": (_riff,),
    "ply": (_header_text, _header_text, _edge),
    "safetensors": (_safetensors,),
    "pickle": (_pickle,),
    "vl": (_count, _number),
}
