"""Stanford's .ply, text or binary in either order of bytes, as many programs write it.

Elements are records of numbers and of lists of numbers. Where all records of an element are equally
long they are read at once; otherwise, as for triangles mixed with quads, one after the other.

    vertex      x y z; colours red green blue, diffuse_red … or r g b; s t, u v or texture_u …
    face        a list vertex_indices or vertex_index, a list texcoord, texnumber, red green blue
    tristrips   a list vertex_indices, -1 beginning another strip
    multi_texture_vertex, multi_texture_face    places in pictures, as RealityCapture has them
    comment TextureFile NAME
"""

from __future__ import annotations

import re
import struct
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import ElocuteWarning, InputError
from elocute.meshes.obj_mesh import line_name
from elocute.meshes.polygon_mesh import PolygonMesh, color_bytes

HEADER_MAX_BYTES = 1_000_000
PADDING_BYTES = 16
"""Bytes after the last record that nobody misses."""
NUMBERS_MAX = 100_000_000
"""Of numbers and lists in records of unlike lengths, which are noted one by one."""
TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": "="}
COUNT_TEXT = re.compile(r"[0-9]{1,10}", re.ASCII)
NO_NUMBER = re.compile(rb"(?i)[-+]?(?:1\.#[a-z0-9]+|nan\([a-z]*\))")
"""Microsoft's words for NaN and infinity."""
COLOR_NAMES = (
    ("red", "green", "blue"),
    ("diffuse_red", "diffuse_green", "diffuse_blue"),
    ("r", "g", "b"),
)
PLACE_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
CORNER_NAMES = ("vertex_indices", "vertex_index")
STRIP_NAMES = ("tristrips", "tristrip")


@dataclass(frozen=True)
class _Property:
    name: str
    kind: str  # as declared, of NumPy
    counted: str = ""  # the kind of a list's count


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: tuple[_Property, ...]


@dataclass(frozen=True, eq=False)
class _Column:
    """The numbers of one property in all records; sizes: of its lists."""

    values: NDArray[Any]
    kind: str
    sizes: NDArray[np.int64] | None = None

    def whole(self) -> NDArray[np.int64]:
        """Its numbers as whole ones. Raises ValueError for others."""
        if self.values.dtype.kind == "f" and not np.array_equal(np.floor(self.values), self.values):
            raise ValueError("indices that are no whole numbers")
        return self.values.astype(np.int64)


_Columns = dict[str, _Column]


class _ShortError(Exception):
    """There are fewer numbers than the header says."""


def parse_ply(data: bytes, path: Path, error: type[InputError]) -> PolygonMesh:
    """The polygons of a .ply.

    Raises an `error` for another header, and a file with fewer or more numbers than its header
    says.
    """
    try:
        order, elements, pictures, start = _header(data)
        columns = _columns(data, start, order, elements, path)
        return _mesh(columns, pictures)
    except InputError:
        raise
    except _ShortError:
        raise error.about(
            path, found="shorter than its header says", allowed="a whole mesh"
        ) from None
    except KeyError as problem:
        found = f"numbers of type {str(problem)[:40]}"
        raise error.about(path, found=found, allowed=", ".join(TYPES)) from None
    except (ValueError, IndexError, OverflowError, struct.error) as problem:
        found = f"no mesh that can be read ({' '.join(str(problem).split())[:80]})"
        raise error.about(path, found=found, allowed="a .ply as others read it") from problem


def _header(data: bytes) -> tuple[str, list[_Element], tuple[str, ...], int]:
    """The order of bytes, the elements, the pictures that are named, and where numbers begin."""
    data = data[:HEADER_MAX_BYTES]
    data = data.removeprefix(b"\xef\xbb\xbf") if data[:1] == b"\xef" else data
    skipped = 0 if data[:3].lower() == b"ply" else -1
    end = re.search(rb"[\r\n]end_header[ \t]*(\r\n|\r|\n|\Z)", data)
    if skipped or end is None:
        raise ValueError("no header of a .ply")
    # Text that ends its lines by CR alone; else a CR may be the first byte of a number.
    opening = data[: end.start()]
    stop = end.end()
    if end[1] == b"\r\n" and b"\r\n" not in opening:
        stop -= 1
    order, elements, pictures = "", list[_Element](), list[str]()
    for line in opening.splitlines()[1:]:
        words = line.decode("ascii", "replace").split()
        match words:
            case ["format", kind, *_]:
                order = ORDERS[kind] if kind in ORDERS else _fail(f"format {kind[:40]}")
            case ["comment" | "obj_info", word, _, *_] if word.lower() == "texturefile":
                pictures.append(line_name(line.split(None, 1)[1]))
            case ["element", name, count, *_] if COUNT_TEXT.fullmatch(count):
                elements.append(_Element(name.lower(), int(count), ()))
            case ["property", "list", counted, kind, name, *_] if elements:
                _extend(elements, _Property(name.lower(), TYPES[kind], TYPES[counted]))
            case ["property", kind, name, *_] if elements:
                _extend(elements, _Property(name.lower(), TYPES[kind]))
            case [] | ["comment" | "obj_info", *_]:
                pass
            case _:
                _fail(" ".join(words)[:60])
    return order or _fail("no format"), elements, tuple(pictures), stop


def _fail(why: str) -> Any:
    raise ValueError(why)


def _extend(elements: list[_Element], one: _Property) -> None:
    last = elements[-1]
    elements[-1] = _Element(last.name, last.count, (*last.properties, one))


def _columns(
    data: bytes, start: int, order: str, elements: list[_Element], path: Path
) -> dict[str, _Columns]:
    """The columns of each element. A text is read as a binary file of doubles."""
    text, source = order == "=", np.frombuffer(data, np.uint8)
    if text:
        source, start = _numbers(data[start:]).view(np.uint8), 0
    columns: dict[str, _Columns] = {}
    for element in elements:
        if not element.properties:
            continue
        kinds = [(p.kind, p.counted) for p in element.properties]
        kinds = [("f8", c and "f8") for _, c in kinds] if text else kinds
        columns[element.name], start = _Records(source, order, kinds).read(element, start)
    left = len(source) - start
    if text and left:
        raise ValueError(f"{left // 8} numbers more than its header says")
    if left > PADDING_BYTES:
        warnings.warn(
            f"{path}: {left} bytes more than its header says were left out",
            ElocuteWarning,
            stacklevel=2,
        )
    return columns


def _numbers(text: bytes) -> NDArray[np.float64]:
    """All numbers of a text. Raises ValueError for other words."""
    if b"#" in text or b"(" in text:
        text = NO_NUMBER.sub(b"nan", text)
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return np.fromstring(text.decode("ascii").strip(), np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            raise ValueError("words that are no numbers") from None


class _Records:
    """The records of one element in bytes; kinds: of each property, and of a list's count."""

    def __init__(self, data: NDArray[np.uint8], order: str, kinds: list[tuple[str, str]]) -> None:
        self._data, self._bytes, self._order = data, data.data, order
        self._kinds = [
            (np.dtype(order + kind), np.dtype(order + counted) if counted else None)
            for kind, counted in kinds
        ]

    def read(self, element: _Element, start: int) -> tuple[_Columns, int]:
        """The columns, and where the next element begins. Raises _ShortError."""
        least = sum((count or kind).itemsize for kind, count in self._kinds)
        if element.count * least > len(self._data) - start:
            raise _ShortError
        records = self._alike(element.count, start) or self._one_by_one(element.count, start)
        values, sizes, end = records
        columns: _Columns = {}
        for one, value, size in zip(element.properties, values, sizes, strict=True):
            columns.setdefault(one.name, _Column(value, one.kind, size))
        return columns, end

    def _alike(self, count: int, start: int) -> tuple[list[Any], list[Any], int] | None:
        """Values, sizes of lists and the end, where all records are as long as the first."""
        fields: list[Any] = []
        at = start
        for number, (kind, counted) in enumerate(self._kinds):
            size = 1
            if counted:
                fields.append((f"n{number}", counted))
                size = self._size(counted, at) if count else 0
                at += counted.itemsize
            fields.append((f"v{number}", kind, (size,)))
            at += size * kind.itemsize
        if count and at > len(self._data):
            raise _ShortError
        record = np.dtype(fields)
        end = start + count * record.itemsize
        if end > len(self._data):
            return None
        rows = np.frombuffer(self._data, record, count, start) if count else np.zeros(0, record)
        values, sizes = list[Any](), list[Any]()
        for number, (_, counted) in enumerate(self._kinds):
            column: Any = rows[f"v{number}"]
            width = column.shape[1]
            if counted and count and (rows[f"n{number}"] != width).any():
                return None
            values.append(np.ascontiguousarray(column).ravel())
            sizes.append(np.full(count, width, np.int64) if counted else None)
        return values, sizes, end

    def _one_by_one(self, count: int, start: int) -> tuple[list[Any], list[Any], int]:
        """As `_alike`, for records of unlike lengths."""
        if count * len(self._kinds) > NUMBERS_MAX:
            raise ValueError(f"{count} records of unlike lengths")
        starts = np.zeros((len(self._kinds), count), np.int64)
        sizes = np.ones((len(self._kinds), count), np.int64)
        steps = [(kind.itemsize, counted) for kind, counted in self._kinds]
        at, limit = start, len(self._data)
        for row in range(count):
            for number, (width, counted) in enumerate(steps):
                size = 1
                if counted:
                    size = self._size(counted, at)
                    at += counted.itemsize
                    sizes[number, row] = size
                starts[number, row] = at
                at += size * width
            if at > limit:
                raise _ShortError
        values = [
            self._gathered(starts[number], sizes[number], kind)
            for number, (kind, _) in enumerate(self._kinds)
        ]
        lists = [sizes[n] if counted else None for n, (_, counted) in enumerate(self._kinds)]
        return values, lists, at

    def _size(self, counted: np.dtype[Any], at: int) -> int:
        """The length of a list. Raises _ShortError, ValueError."""
        if at + counted.itemsize > len(self._data):
            raise _ShortError
        code = self._order + counted.char
        number = (
            self._bytes[at] if counted.char == "B" else struct.unpack_from(code, self._bytes, at)[0]
        )
        size = int(number)
        if size != number or size < 0:
            raise ValueError(f"a list of {number} numbers")
        return size

    def _gathered(
        self, starts: NDArray[np.int64], sizes: NDArray[np.int64], kind: np.dtype[Any]
    ) -> NDArray[Any]:
        """The numbers of lists, one list after the other."""
        within = np.arange(int(sizes.sum())) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        places = np.repeat(starts, sizes) + kind.itemsize * within
        packed = np.empty((len(places), kind.itemsize), np.uint8)
        for byte in range(kind.itemsize):
            packed[:, byte] = self._data[places + byte]
        return packed.view(kind).ravel()


def _mesh(columns: dict[str, _Columns], pictures: tuple[str, ...]) -> PolygonMesh:
    vertex = columns.get("vertex", {})
    if not {"x", "y", "z"} <= set(vertex):
        raise ValueError("no x, y, z of its vertices")
    points = np.stack([vertex[axis].values.astype(np.float64) for axis in "xyz"], axis=1)
    corners, sizes = _faces(columns)
    uv, places = _places(columns, corners, sizes)
    colors = _colors(vertex)
    if colors is None and len(sizes):
        colors = _face_colors(columns, corners, sizes, len(points))
    return PolygonMesh(
        points, colors, corners, sizes, uv, places, _pictures(columns, sizes, pictures), pictures
    )


def _faces(columns: dict[str, _Columns]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Corners and sizes of faces, else of triangle strips."""
    face = columns.get("face", {})
    column = next((face[name] for name in CORNER_NAMES if name in face), None)
    if column is None:
        lists = [each for each in face.values() if each.sizes is not None and each.kind[0] != "f"]
        column = lists[0] if len(lists) == 1 else None
    if column is not None and column.sizes is not None and len(column.sizes):
        return column.whole(), column.sizes
    strips = next((columns[name] for name in STRIP_NAMES if name in columns), {})
    column = next((each for each in strips.values() if each.sizes is not None), None)
    if column is None or column.sizes is None:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    triangles = _unrolled(column.whole(), column.sizes)
    return triangles.ravel(), np.full(len(triangles), 3, np.int64)


def _unrolled(line: NDArray[np.int64], sizes: NDArray[np.int64]) -> NDArray[np.int64]:
    """(triangle, 3) corners of strips, every other one turned; -1 begins another strip."""
    begins = np.zeros(len(line) + 1, bool)
    begins[np.cumsum(sizes) - sizes] = True
    begins[np.flatnonzero(line < 0) + 1] = True
    strip = np.cumsum(begins[:-1])
    first = np.flatnonzero(begins[:-1])
    odd = (np.arange(len(line)) - first[strip - 1])[:-2] % 2 == 1 if len(line) else []
    rows = np.stack([line[:-2], line[1:-1], line[2:]], axis=1)
    rows[odd] = rows[odd][:, [1, 0, 2]]
    whole = (strip[:-2] == strip[2:]) & (rows >= 0).all(axis=1)
    a, b, c = rows.T
    return rows[whole & (a != b) & (b != c) & (c != a)]


def _colors(columns: _Columns) -> NDArray[np.uint8] | None:
    for names in COLOR_NAMES:
        if set(names) <= set(columns):
            values = np.stack([columns[name].values for name in names], axis=1)
            kind = columns[names[0]].kind
            # In texts bytes are declared for shares of one.
            return color_bytes(values, kind if np.array_equal(values, np.floor(values)) else "f4")
    return None


def _face_colors(
    columns: dict[str, _Columns],
    corners: NDArray[np.int64],
    sizes: NDArray[np.int64],
    count: int,
) -> NDArray[np.uint8] | None:
    """(vertex, 3) the mean colour of the faces around each vertex."""
    colors = _colors(columns.get("face", {}))
    if colors is None or len(colors) != len(sizes) or corners.min() < 0 or corners.max() >= count:
        return None
    spread = np.repeat(colors, sizes, axis=0).astype(np.float64)
    total = [np.bincount(corners, spread[:, band], count) for band in range(3)]
    around = np.maximum(np.bincount(corners, minlength=count), 1)
    return np.round(np.stack(total, axis=1) / around[:, None]).astype(np.uint8)


def _places(
    columns: dict[str, _Columns], corners: NDArray[np.int64], sizes: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Places in pictures, and the place of each corner: of faces, of a table, or of vertices."""
    listed = columns.get("face", {}).get("texcoord")
    if listed is not None and listed.sizes is not None:
        uv = listed.values.astype(np.float64)
        full = listed.sizes == 2 * sizes
        if full.all():
            return uv.reshape(-1, 2), np.arange(len(corners))
        starts = np.cumsum(listed.sizes) - listed.sizes
        within = np.arange(len(corners)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        rows = np.repeat(starts, sizes) + 2 * within
        rows = np.where(np.repeat(full, sizes), rows, len(uv))
        padded = np.concatenate([uv, np.zeros(2)])
        place = np.where(rows < len(uv), np.arange(len(corners)), -1)
        return np.stack([padded[rows], padded[rows + 1]], axis=1), place
    table, faces = columns.get("multi_texture_vertex", {}), columns.get("multi_texture_face", {})
    rows = next((each for each in faces.values() if each.sizes is not None), None)
    alike = rows is not None and rows.sizes is not None and np.array_equal(rows.sizes, sizes)
    if {"u", "v"} <= set(table) and rows is not None and alike:
        return np.stack([table[a].values.astype(np.float64) for a in "uv"], axis=1), rows.whole()
    vertex = columns["vertex"]
    for u, v in PLACE_NAMES:
        if u in vertex and v in vertex:
            uv = np.stack([vertex[axis].values.astype(np.float64) for axis in (u, v)], axis=1)
            return uv, corners.copy()
    return np.zeros((0, 2)), np.full(len(corners), -1, np.int64)


def _pictures(
    columns: dict[str, _Columns], sizes: NDArray[np.int64], pictures: tuple[str, ...]
) -> NDArray[np.int64]:
    """(face,) which of the pictures each face has, -1 for none."""
    for name, column in (("face", "texnumber"), ("multi_texture_face", "tx")):
        listed = columns.get(name, {}).get(column)
        if listed is not None and len(listed.values) == len(sizes):
            numbers = listed.whole()
            return np.where((numbers >= 0) & (numbers < len(pictures)), numbers, -1)
    return np.full(len(sizes), 0 if pictures else -1, np.int64)
