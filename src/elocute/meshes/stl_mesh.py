"""STL, binary and text: triangles without materials."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from elocute.errors import InputError
from elocute.meshes.polygon_mesh import PolygonMesh

HEAD_BYTES = 84
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
CORNER = re.compile(rb"(?i)vertex\s+(\S+)\s+(\S+)\s+(\S+)")


def parse_stl(data: bytes, path: Path, error: type[InputError]) -> PolygonMesh:
    """The triangles of an .stl, each with three points of its own.

    Parameters
    ----------
    data : bytes
        The file's content.
    path : Path
        Its name, for messages.
    error : type of InputError
        The class to raise.

    Raises
    ------
    InputError
        Of the class `error`, for a file that is cut short, or is no .stl.
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
