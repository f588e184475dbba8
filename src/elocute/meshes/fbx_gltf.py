"""FBX files as glTF, by Blender's Python module where that is installed.

File paths are stripped from the strings of a file before. Its records are an end, counts of
properties, a name, properties, then records inside. Source: the layout as Blender's developers
describe it (code.blender.org, "FBX binary file format").
"""

from __future__ import annotations

import importlib.util
import struct
import subprocess
import sys
import tempfile
from functools import lru_cache
from pathlib import Path

from elocute.errors import InputError, MachineError
from elocute.files.reading import FileKind, read_bytes
from elocute.meshes import fbx_child

MAGIC = b"Kaydara FBX Binary  \x00\x1a\x00"
SIZES = {b"Y": 2, b"C": 1, b"B": 1, b"I": 4, b"F": 4, b"D": 8, b"L": 8}
ITEMS = {b"f": 4, b"d": 8, b"l": 8, b"i": 4, b"b": 1, b"c": 1}
PROPERTIES_MAX = 5_000_000
WIDE_FROM = 7500
"""The version whose records have 64-bit ends."""
_LENGTH, _ARRAY = struct.Struct("<I"), struct.Struct("<III")
FILE_MAX_BYTES = 400_000_000
TIME_MAX_S = 600.0
KEPT = 2
ALLOWED = "a sound binary .fbx of up to 400 MB"


def read_fbx(path: str | Path, *, error: type[InputError] = InputError) -> bytes:
    """Read a binary FBX file as a .glb with everything inside.

    Pictures are those that the file holds; what it only names is not looked for. Raises an `error`
    for a file that is missing, too large, damaged or no binary FBX; MachineError where Blender's
    module `bpy` is not installed.
    """
    data = read_bytes(path, FileKind(ALLOWED, FILE_MAX_BYTES, error))
    try:
        sound = without_places(data)
    except ValueError as problem:
        raise error.about(
            path,
            found=f"no FBX that can be read ({problem})",
            allowed=ALLOWED,
            remedy="export it anew, as binary FBX or better as .glb",
        ) from problem
    if importlib.util.find_spec("bpy") is None:
        raise MachineError(
            f"{path}: FBX is read by Blender's Python module; install it (pip install bpy), or "
            "export the file from Blender as .glb"
        )
    try:
        return _converted(sound)
    except ValueError as problem:
        raise error.about(
            path, found="an FBX that Blender cannot read", allowed=ALLOWED
        ) from problem


@lru_cache(maxsize=KEPT)
def _converted(data: bytes) -> bytes:
    """What Blender makes of the file. Raises ValueError where it makes nothing."""
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "head.fbx", Path(folder) / "head.glb"
        source.write_bytes(data)
        try:
            subprocess.run(
                [sys.executable, "-I", fbx_child.__file__, str(source), str(target)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                cwd=folder,
                timeout=TIME_MAX_S,
                check=True,
            )
            return target.read_bytes()
        except (subprocess.SubprocessError, OSError) as problem:
            raise ValueError("nothing was written") from problem


def without_places(data: bytes) -> bytes:
    """A binary FBX file with `/` and `\\` in its texts replaced, so that no text is a path.

    Of the same length. Raises ValueError for another file, and for records that do not fit.
    """
    if not data.startswith(MAGIC) or len(data) < len(MAGIC) + 4:
        raise ValueError("no binary FBX")
    (version,) = _LENGTH.unpack_from(data, len(MAGIC))
    header = struct.Struct("<QQQB" if version >= WIDE_FROM else "<IIIB")
    cleaned, place, ends, count = bytearray(data), len(MAGIC) + 4, [], 0
    try:
        while True:
            end, properties, _, name = header.unpack_from(data, place)
            place += header.size
            if not end:  # the last of a list
                if not ends:
                    return bytes(cleaned)
                if place != ends.pop():
                    raise ValueError("a list that ends elsewhere")
                continue
            count += properties
            if count > PROPERTIES_MAX or end > (ends[-1] if ends else len(data)):
                raise ValueError("records that do not fit")
            place += name
            for _ in range(properties):
                place = _next_property(data, place, cleaned)
            if place > end:
                raise ValueError("properties that do not fit")
            if place < end:
                ends.append(end)
    except struct.error as problem:
        raise ValueError("it ends early") from problem


def _next_property(data: bytes, place: int, cleaned: bytearray) -> int:
    """Where the property behind this one begins; texts are changed in `cleaned`."""
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
        cleaned[place : place + length] = text[:1] + b"_" + text[2:] if text[1:2] == b":" else text
    return place + length
