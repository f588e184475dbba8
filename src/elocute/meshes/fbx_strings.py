"""Strips file paths from the strings of a binary FBX.

Records are an end, counts of properties, a name, properties, then records inside. Source: the
layout as Blender's developers describe it (code.blender.org, "FBX binary file format").
"""

from __future__ import annotations

import struct

MAGIC = b"Kaydara FBX Binary  \x00\x1a\x00"
SIZES = {b"Y": 2, b"C": 1, b"B": 1, b"I": 4, b"F": 4, b"D": 8, b"L": 8}
ITEMS = {b"f": 4, b"d": 8, b"l": 8, b"i": 4, b"b": 1, b"c": 1}
PROPERTIES_MAX = 5_000_000
WIDE_FROM = 7500
"""The version whose records have 64-bit ends."""
_LENGTH, _ARRAY = struct.Struct("<I"), struct.Struct("<III")


def without_places(data: bytes) -> bytes:
    """The file with `/` and `\\` in its texts replaced, so that no text is a path.

    Parameters
    ----------
    data : bytes
        A binary FBX file.

    Returns
    -------
    bytes
        Of the same length.

    Raises
    ------
    ValueError
        For another file, and for records that do not fit each other.
    """
    if not data.startswith(MAGIC) or len(data) < len(MAGIC) + 4:
        raise ValueError("no binary FBX")
    (version,) = _LENGTH.unpack_from(data, len(MAGIC))
    header = struct.Struct("<QQQB" if version >= WIDE_FROM else "<IIIB")
    made, place, ends, count = bytearray(data), len(MAGIC) + 4, [], 0
    try:
        while True:
            end, properties, _, name = header.unpack_from(data, place)
            place += header.size
            if not end:  # the last of a list
                if not ends:
                    return bytes(made)
                if place != ends.pop():
                    raise ValueError("a list that ends elsewhere")
                continue
            count += properties
            if count > PROPERTIES_MAX or end > (ends[-1] if ends else len(data)):
                raise ValueError("records that do not fit")
            place += name
            for _ in range(properties):
                place = _next_property(data, place, made)
            if place > end:
                raise ValueError("properties that do not fit")
            if place < end:
                ends.append(end)
    except struct.error as problem:
        raise ValueError("it ends early") from problem


def _next_property(data: bytes, place: int, made: bytearray) -> int:
    """Where the property behind this one begins; texts are changed in `made`."""
    kind = data[place : place + 1]
    place += 1
    if kind in SIZES:
        return place + SIZES[kind]
    if kind in ITEMS:
        length, encoding, packed = _ARRAY.unpack_from(data, place)
        return place + _ARRAY.size + (packed if encoding else length * ITEMS[kind])
    if kind not in (b"S", b"R"):
        raise ValueError(f"a property of kind {kind!r}")
    (length,) = _LENGTH.unpack_from(data, place)
    place += _LENGTH.size
    if place + length > len(data):
        raise ValueError("a text that ends early")
    if kind == b"S":
        text = data[place : place + length].replace(b"/", b"_").replace(b"\\", b"_")
        # A drive's letter names a place as well; a namespace is longer.
        made[place : place + length] = text[:1] + b"_" + text[2:] if text[1:2] == b":" else text
    return place + length
