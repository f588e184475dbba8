"""Wavefront .obj as many programs write it: read line by line, with memory in step with its size.

    v x y z [r g b]       colours to 1 or 255, as MeshLab and scanners write them
    #MRGB aarrggbb…       colours as ZBrush writes them, up to 64 vertices a line
    vt u v                places in a picture
    f 1 2 3 4             corners v, v/vt, v//vn or v/vt/vn, counted from 1, or back from -1
    usemtl, mtllib        the material of the faces that follow, and where materials are described

Lines may go on after a backslash and end in comments. What is not named here is passed over.
"""

from __future__ import annotations

import io
from array import array
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError
from elocute.meshes.polygon_mesh import PolygonMesh, color_bytes

POLYPAINT = b"#MRGB"
NAME_MAX = 300


def parse_obj(data: bytes, path: Path, error: type[InputError]) -> PolygonMesh:
    """The polygons of an .obj. Raises an `error` for lines that cannot be read."""
    lines = _Lines()
    for number, line in enumerate(text_lines(data), 1):
        words = line.split()
        reader = lines.readers.get(words[0]) if words else None
        try:
            if reader:
                if b"#" in line:
                    words = line.partition(b"#")[0].split()
                reader(words)
            elif words and words[0] in (b"usemtl", b"mtllib"):
                lines.name(words[0], line_name(line))
            elif words and words[0] == POLYPAINT:
                lines.polypaint += bytes.fromhex(b"".join(words[1:]).decode())
        except (ValueError, IndexError, OverflowError):
            found = f"line {number}, {line[:60].decode('latin-1').strip()!r}"
            raise error.about(path, found=found, allowed="an .obj as others read it") from None
    return lines.mesh()


def text_lines(data: bytes) -> io.BytesIO:
    """Lines of a text of any system, those that a backslash continues joined to one."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\n" not in data:
        data = data.replace(b"\r", b"\n")
    if b"\\\n" in data or b"\\\r\n" in data:
        data = data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
    return io.BytesIO(data)


def line_name(line: bytes) -> str:
    """What follows the first word of a line: a name, which may hold spaces."""
    rest = line.split(None, 1)[1:] or [b""]
    try:
        return rest[0].decode("utf-8").strip()[:NAME_MAX]
    except UnicodeDecodeError:
        return rest[0].decode("latin-1").strip()[:NAME_MAX]


class _Lines:
    """What lines have said so far, in flat arrays."""

    def __init__(self) -> None:
        self.points, self.tints, self.uv = array("d"), array("d"), array("d")
        self.tinted = array("q")
        self.corners, self.places = array("q"), array("q")
        self.sizes, self.materials = array("q"), array("q")
        self.names: dict[str, int] = {}
        self.libraries: dict[str, None] = {}
        self.polypaint = bytearray()
        self.material = -1
        self.readers = {b"v": self._vertex, b"vt": self._place, b"f": self._face}

    def name(self, kind: bytes, name: str) -> None:
        """Begin a material, or note a file of materials."""
        if kind == b"mtllib":
            self.libraries[name] = None
        else:
            self.material = self.names.setdefault(name, len(self.names))

    def _vertex(self, words: list[bytes]) -> None:
        x, y, z = words[1:4]
        self.points.extend((float(x), float(y), float(z)))
        if len(words) >= 7:
            self.tints.extend(map(float, words[4:7]))
            self.tinted.append(len(self.points) // 3 - 1)

    def _place(self, words: list[bytes]) -> None:
        self.uv.extend((float(words[1]), float(words[2]) if len(words) > 2 else 0.0))

    def _face(self, words: list[bytes]) -> None:
        points, places = len(self.points) // 3, len(self.uv) // 2
        for word in words[1:]:
            corner, _, rest = word.partition(b"/")
            self.corners.append(_row(int(corner), points))
            place = rest.partition(b"/")[0]
            number = int(place) if place else 0
            self.places.append(number - 1 if number >= 0 else places + number)
        self.sizes.append(len(words) - 1)
        self.materials.append(self.material)

    def mesh(self) -> PolygonMesh:
        """All of it, unchecked."""
        points = np.array(self.points).reshape(-1, 3)
        return PolygonMesh(
            points,
            self._colors(len(points)),
            np.array(self.corners, np.int64),
            np.array(self.sizes, np.int64),
            np.array(self.uv).reshape(-1, 2),
            np.array(self.places, np.int64),
            np.array(self.materials, np.int64),
            tuple(self.names),
            tuple(self.libraries),
        )

    def _colors(self, count: int) -> NDArray[np.uint8] | None:
        """(vertex, 3) sRGB, white where only others have one."""
        if len(self.tinted):
            colors = np.full((count, 3), 255, np.uint8)
            colors[np.array(self.tinted)] = color_bytes(np.array(self.tints).reshape(-1, 3), "f8")
            return colors
        paint = np.frombuffer(bytes(self.polypaint), np.uint8)
        return paint.reshape(-1, 4)[:, 1:].copy() if count and len(paint) == 4 * count else None


def _row(number: int, count: int) -> int:
    """The row of an element counted from 1, or back from -1. Raises ValueError for others."""
    if not -count <= number or not number:
        raise ValueError("counted from 1")
    return number - 1 if number > 0 else count + number
