"""Reads mesh files as polygons, .stl here, and sizes of pictures before they are decoded."""

from __future__ import annotations

import io
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from elocute.errors import InputError
from elocute.files.reading import bytes_text, read_bytes
from elocute.files.unpacked_size import unpacked_limit
from elocute.meshes.obj_mesh import parse_obj
from elocute.meshes.part import drawn_picture
from elocute.meshes.ply_mesh import parse_ply
from elocute.meshes.polygon_mesh import PolygonMesh, checked_mesh

HEAD_BYTES = 84
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
CORNER = re.compile(rb"(?i)vertex\s+(\S+)\s+(\S+)\s+(\S+)")
SUFFIXES = (".obj", ".ply")
"""Meshes in which the order of vertices may be a known one."""
PICTURE_FORMATS = ("PNG", "JPEG", "BMP", "TIFF", "WEBP", "TGA")
UNPACKED_MIN_BYTES = 4 * 4096 * 4096
"""A picture may unpack to this much, however small its file is."""


def read_mesh_file(
    path: str | Path, *, max_bytes: int, error: type[InputError], cloud: bool = False
) -> PolygonMesh:
    """Read an .obj, .ply or .stl with its vertices in order; no other file is looked for.

    All corners are there, and some triangles at least, but where `cloud` allows points alone.
    Raises an `error` for a file that is missing, too large, damaged, or not a mesh.
    """
    path = Path(path)
    parse = PARSERS.get(path.suffix.lower())
    if parse is None:
        raise error.about(path, found=f"suffix {path.suffix!r}", allowed=" ".join(PARSERS))
    data = read_bytes(path, max_bytes=max_bytes, allowed="a mesh", error=error)
    return checked_mesh(parse(data, path, error), path, error, cloud)


def check_picture(
    data: bytes, subject: str | Path, error: type[InputError] = InputError
) -> tuple[int, int]:
    """Width and height of a picture in pixels, before these are decoded.

    Raises an `error` for anything but a picture of `PICTURE_FORMATS`, and for one that would unpack
    to far more than its size.
    """
    from PIL import Image

    allowed = f"a picture ({', '.join(PICTURE_FORMATS)})"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data), formats=PICTURE_FORMATS) as picture:
                width, height = picture.size
    except Image.DecompressionBombError as problem:
        found = f"a picture of far too many pixels in {bytes_text(len(data))}"
        raise error.about(subject, found=found, allowed=allowed) from problem
    except Exception as problem:  # PIL's parsers raise of every kind
        raise error.about(subject, found="no picture", allowed=allowed) from problem
    limit = unpacked_limit(len(data), UNPACKED_MIN_BYTES)
    if 4 * width * height > limit:
        raise error.about(
            subject,
            found=f"a picture of {width} × {height} pixels in {bytes_text(len(data))}",
            allowed=f"up to {bytes_text(limit)} unpacked",
        )
    return width, height


def opened_picture(
    data: bytes, subject: str | Path, error: type[InputError], mode: Any = None
) -> tuple[Any, str]:
    """A checked picture as `drawn_picture` gives it. Raises an `error` for a damaged one."""
    from PIL import Image

    try:
        return drawn_picture(Image.open(io.BytesIO(data), formats=PICTURE_FORMATS), mode)
    except Exception as problem:  # PIL's parsers raise of every kind
        raise error.about(
            subject, found="a damaged picture", allowed="pictures that can be read"
        ) from problem


def parse_stl(data: bytes, path: Path, error: type[InputError]) -> PolygonMesh:
    """The triangles of an .stl, each with three points of its own.

    Raises an `error` for a file that is cut short, or is no .stl.
    """
    count = int.from_bytes(data[80:HEAD_BYTES], "little")
    whole = len(data) >= HEAD_BYTES and len(data) - HEAD_BYTES >= count * RECORD.itemsize
    # Binary files may begin with "solid", too: their size tells.
    if data.lstrip()[:5].lower() == b"solid" and b"facet" in data[:100_000].lower():
        try:
            found = [tuple(map(float, row)) for row in CORNER.findall(data)]
        except ValueError:
            raise error.about(path, found="words that are no numbers", allowed="an .stl") from None
        points = np.array(found[: len(found) // 3 * 3], np.float64).reshape(-1, 3)
    elif whole:
        rows = np.frombuffer(data, RECORD, count, HEAD_BYTES)
        points = rows["corners"].astype(np.float64).reshape(-1, 3)
    else:
        raise error.about(path, found="no .stl, or one cut short", allowed="a whole mesh")
    corners = np.arange(len(points))
    sizes = np.full(len(points) // 3, 3, np.int64)
    none = np.full(len(corners), -1, np.int64)
    return PolygonMesh(points, None, corners, sizes, np.zeros((0, 2)), none, none[: len(sizes)])


PARSERS = {".obj": parse_obj, ".ply": parse_ply, ".stl": parse_stl}
