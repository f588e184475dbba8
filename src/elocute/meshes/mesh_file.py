"""Reads mesh files as polygons, and sizes of pictures before they are decoded."""

from __future__ import annotations

import io
import warnings
from pathlib import Path

from elocute.errors import InputError
from elocute.files.reading import FileKind, bytes_text, read_bytes
from elocute.files.unpacked_size import unpacked_limit
from elocute.meshes.obj_mesh import parse_obj
from elocute.meshes.ply_mesh import parse_ply
from elocute.meshes.polygon_mesh import PolygonMesh, checked_mesh
from elocute.meshes.stl_mesh import parse_stl

SUFFIXES = (".obj", ".ply")
"""Meshes in which the order of vertices may be a known one."""
PARSERS = {".obj": parse_obj, ".ply": parse_ply, ".stl": parse_stl}
PICTURE_FORMATS = ("PNG", "JPEG", "BMP", "TIFF", "WEBP", "TGA")
UNPACKED_MIN_BYTES = 4 * 4096 * 4096
"""A picture may unpack to this much, however small its file is."""


def read_mesh_file(
    path: str | Path, *, max_bytes: int, error: type[InputError], cloud: bool = False
) -> PolygonMesh:
    """Read a mesh, with its vertices in the order of the file; no other file is looked for.

    Parameters
    ----------
    path : str or Path
        An .obj, .ply or .stl.
    max_bytes : int
        Largest size of the file, bytes.
    error : type of InputError
        The class to raise.
    cloud : bool
        Whether points without triangles are allowed.

    Returns
    -------
    PolygonMesh
        All corners are there; some triangles at least, but for a cloud.

    Raises
    ------
    InputError
        Of the class `error`, for a file that is missing, too large, damaged, or not a mesh.
    """
    path = Path(path)
    parse = PARSERS.get(path.suffix.lower())
    if parse is None:
        raise error.about(path, found=f"suffix {path.suffix!r}", allowed=" ".join(PARSERS))
    data = read_bytes(path, FileKind("a mesh", max_bytes, error))
    return checked_mesh(parse(data, path, error), path, error, cloud)


def check_picture(
    data: bytes, subject: str | Path, error: type[InputError] = InputError
) -> tuple[int, int]:
    """Check a picture before its pixels are decoded.

    Parameters
    ----------
    data : bytes
        The file's content.
    subject : str or Path
        Where it is from, for the message.
    error : type of InputError
        The class to raise.

    Returns
    -------
    width, height : int
        Pixels.

    Raises
    ------
    InputError
        Of the class `error`, for anything but a picture of `PICTURE_FORMATS`, and for one that
        would unpack to far more than its size.
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
