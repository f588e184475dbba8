"""Builds a binary FBX file: records that hold properties and records, and objects that are joined.

Source: the layout as Blender's developers describe it (code.blender.org, "FBX binary file format").
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute._version import __version__
from elocute.meshes.fbx_gltf import MAGIC

VERSION = 7400
SECOND = 46_186_158_000
"""Ticks of a second, whole for all usual frame rates."""
RATES = {120.0: 1, 100.0: 2, 60.0: 3, 50.0: 4, 48.0: 5, 30.0: 6, 25.0: 10, 24.0: 11, 96.0: 15}
"""Numbers of the format by frames a second; any other rate stands in the file."""
CUSTOM_RATE = 14
LINEAR = 4  # between keys
SEPARATOR = "\0\1"
# The format's checksums of a file's first second in 1970: the same motion gives the same bytes.
CREATED = "1970-01-01 10:00:00:000"
FILE_ID = bytes.fromhex("28b32aebb624ccc2bfc8b02aa92bfcf1")
FOOT_ID = bytes.fromhex("fabcab09d0c8d466b176fb831cf7267e")
LAST = bytes.fromhex("f85a8c6adef5d97eece90ce3758f290b")
_HEADER, _ARRAY = struct.Struct("<IIIB"), struct.Struct("<III")
_ITEMS = {"float64": b"d", "float32": b"f", "int64": b"l", "int32": b"i"}


class Long(int):
    """A whole number of 64 bits."""


@dataclass
class Record:
    """A record: its name, its properties and the records inside."""

    name: str
    # an int has 32 bits, a Long has 64; an array is of `_ITEMS`
    properties: tuple[Any, ...] = ()
    inside: list[Record] = field(default_factory=list)

    def add(self, name: str, *properties: Any) -> Record:
        """Append a record to those inside; the new one."""
        self.inside.append(Record(name, properties))
        return self.inside[-1]

    def fill(self, values: Mapping[str, Any]) -> None:
        """Append records of one property each."""
        for name, value in values.items():
            self.add(name, value)

    def settings(self, values: Mapping[str, Any]) -> None:
        """Append named settings: numbers and texts; or kind, label, flags and values."""
        held = self.add("Properties70")
        for name, value in values.items():
            held.add("P", name, *(value if isinstance(value, tuple) else _typed(value)))

    def packed(self, start: int) -> bytes:
        """Its bytes where it begins at byte `start` of a file."""
        name, written = self.name.encode(), [_property(each) for each in self.properties]
        size = sum(map(len, written))
        place = start + _HEADER.size + len(name) + size
        for each in self.inside:
            written.append(each.packed(place))
            place += len(written[-1])
        if self.inside or not self.properties:
            written.append(bytes(_HEADER.size))
            place += _HEADER.size
        head = _HEADER.pack(place, len(self.properties), size, len(name))
        return b"".join([head, name, *written])


def _typed(value: Any) -> tuple[Any, ...]:
    """Kind, label, flags and value of a setting that is a plain number or text."""
    if isinstance(value, float):
        return ("double", "Number", "", value)
    if isinstance(value, str):
        return ("KString", "", "", value)
    if isinstance(value, Long):
        return ("KTime", "Time", "", value)
    return ("int", "Integer", "", value)


def _property(value: Any) -> bytes:
    if isinstance(value, np.ndarray):
        plain = np.ascontiguousarray(value).tobytes()
        data = zlib.compress(plain)
        kind = _ITEMS[value.dtype.name]
        return kind + _ARRAY.pack(value.size, 1, len(data)) + data
    if isinstance(value, str):
        value = value.encode()
        return b"S" + struct.pack("<I", len(value)) + value
    if isinstance(value, bytes):
        return b"R" + struct.pack("<I", len(value)) + value
    if isinstance(value, Long):
        return b"L" + struct.pack("<q", value)
    if isinstance(value, float):
        return b"D" + struct.pack("<d", value)
    return b"I" + struct.pack("<i", value)


class FbxFile:
    """Objects of a scene, each known by its number, and how they are joined."""

    def __init__(self, fps: float, frames: int, take: str) -> None:
        self.fps, self.frames, self.take = fps, frames, take
        self._objects = Record("Objects")
        self._joined = Record("Connections")

    def add(self, kind: str, name: str, label: str, form: str) -> tuple[Long, Record]:
        """An object: its number, and its record; label, form: its class and sub-class."""
        number = Long(1_000_000 + len(self._objects.inside))
        return number, self._objects.add(kind, number, f"{name}{SEPARATOR}{label}", form)

    def join(self, child: Long, parent: int, place: str = "") -> None:
        """An object hangs on another, 0 for the scene, or on its property `place`."""
        to = Long(parent)
        self._joined.add("C", *(("OP", child, to, place) if place else ("OO", child, to)))

    def ticks(self, frame: Any) -> Any:
        """Times of frames in the unit of the format."""
        return np.round(np.asarray(frame) * (SECOND / self.fps)).astype(np.int64)

    def pack(self) -> bytes:
        """The file."""
        data = MAGIC + struct.pack("<I", VERSION)
        for each in (*self._opening(), self._objects, self._joined, self._takes()):
            data += each.packed(len(data))
        data += bytes(_HEADER.size) + FOOT_ID + bytes(4)
        data += bytes(-len(data) % 16 or 16)
        return data + struct.pack("<I", VERSION) + bytes(120) + LAST

    def _opening(self) -> list[Record]:
        creator = f"Elocute {__version__}"
        header = Record("FBXHeaderExtension")
        header.fill({"FBXHeaderVersion": 1003, "FBXVersion": VERSION, "Creator": creator})
        world = Record("GlobalSettings")
        world.add("Version", 1000)
        world.settings(
            {
                "UpAxis": 1,
                "UpAxisSign": 1,
                "FrontAxis": 2,
                "FrontAxisSign": 1,
                "CoordAxis": 0,
                "CoordAxisSign": 1,
                "UnitScaleFactor": 1.0,  # centimetres
                "TimeMode": ("enum", "", "", RATES.get(self.fps, CUSTOM_RATE)),
                "CustomFrameRate": self.fps,
                **self._span("TimeSpanStart", "TimeSpanStop"),
            }
        )
        documents = Record("Documents")
        documents.add("Count", 1)
        documents.add("Document", Long(1), "", "Scene").add("RootNode", Long(0))
        kinds = Counter(each.name for each in self._objects.inside)
        definitions = Record("Definitions")
        definitions.fill({"Version": 100, "Count": 1 + sum(kinds.values())})
        for kind, count in ({"GlobalSettings": 1} | kinds).items():
            definitions.add("ObjectType", kind).add("Count", count)
        tops = [Record("FileId", (FILE_ID,)), Record("CreationTime", (CREATED,))]
        tops += [Record("Creator", (creator,)), world, documents, Record("References")]
        return [header, *tops, definitions]

    def _span(self, *names: str) -> dict[str, Long]:
        """The first and the last time of the take, under pairs of names."""
        ends = [Long(0), Long(self.ticks(self.frames - 1))]
        return {name: ends[place % 2] for place, name in enumerate(names)}

    def _takes(self) -> Record:
        takes = Record("Takes")
        takes.add("Current", self.take)
        take = takes.add("Take", self.take)
        take.add("FileName", f"{self.take}.tak")
        for name in ("LocalTime", "ReferenceTime"):
            take.add(name, *self._span("", " ").values())
        return takes


class FbxTake:
    """The animation of a file: curves on properties of its objects."""

    def __init__(self, file: FbxFile) -> None:
        self._file = file
        stack, record = file.add("AnimationStack", file.take, "AnimStack", "")
        record.settings(file._span("LocalStart", "LocalStop", "ReferenceStart", "ReferenceStop"))
        self._layer, _ = file.add("AnimationLayer", "Base", "AnimLayer", "")
        file.join(self._layer, stack)

    def move(self, target: Long, place: str, values: Mapping[str, NDArray[Any]]) -> None:
        """A property of an object follows values (frame,), by the names of its parts."""
        node, record = self._file.add("AnimationCurveNode", place[-1], "AnimCurveNode", "")
        record.settings(
            {f"d|{part}": ("Number", "", "A", float(row[0])) for part, row in values.items()}
        )
        self._file.join(node, self._layer)
        self._file.join(node, target, place)
        for part, row in values.items():
            keys = row[:1] if np.ptp(row) == 0 else row
            curve, record = self._file.add("AnimationCurve", "", "AnimCurve", "")
            record.fill(
                {
                    "Default": float(row[0]),
                    "KeyVer": 4008,
                    "KeyTime": self._file.ticks(np.arange(len(keys))),
                    "KeyValueFloat": keys.astype(np.float32),
                    "KeyAttrFlags": np.array([LINEAR], np.int32),
                    "KeyAttrDataFloat": np.zeros(4, np.float32),
                    "KeyAttrRefCount": np.array([len(keys)], np.int32),
                }
            )
            self._file.join(curve, node, f"d|{part}")
