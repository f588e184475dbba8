"""Reads mesh files as polygons (.stl here), and pictures: their sizes before they are decoded."""

from __future__ import annotations

import io
import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError
from elocute.files.reading import FileKind, bytes_text, read_bytes
from elocute.files.unpacked_size import unpacked_limit
from elocute.meshes.obj_mesh import parse_obj
from elocute.meshes.ply_mesh import parse_ply
from elocute.meshes.polygon_mesh import PolygonMesh, checked_mesh

PICTURE_SIDE_MAX = 2048
JPEG_QUALITY = 92
GREY = (190, 190, 190)
ALPHA_MODES = {"MASK": "cutout", "BLEND": "blend"}


@dataclass(frozen=True, eq=False)
class PartOrigin:
    """Where a part of a glTF file comes from."""

    node: int
    mesh: int
    primitive: int  # its number in the mesh
    rows: NDArray[np.int64]  # (vertex,) which of the primitive's vertices these are
    count: int  # vertices of the primitive
    # (vertex, 3, 3) from the primitive's own space to the scene's, at rest, shifts left out
    linear: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MeshPart:
    """Triangles of one material."""

    name: str  # of the mesh, or of its material
    vertices: NDArray[np.float64]  # (vertex, 3) in the file's unit, where its scene puts them
    triangles: NDArray[np.int64]  # (face, 3) corners
    uv: NDArray[np.float64] | None  # (vertex, 2) places in the picture, v upwards
    picture: Any  # the colour, in RGB or RGBA, of at most 2048 pixels a side
    # (vertex, 3) sRGB of the vertices, else of the material, else grey; a picture stands in for it
    colors: NDArray[np.uint8]
    coloured: bool  # whether the file says a colour
    opacity: str  # "opaque", "cutout" or "blend"
    origin: PartOrigin | None = None  # where in a glTF file it is


def drawn_picture(image: Any, mode: Any) -> tuple[Any, str]:
    """A picture in RGB or RGBA of at most 2048 pixels a side, and how its alpha is meant.

    mode: OPAQUE, MASK or BLEND, where the material says so.
    """
    from PIL import Image

    clear = "A" in image.getbands() or "transparency" in image.info
    if image.mode.startswith("I"):  # whole numbers of 16 bits, which are cut off at 255 otherwise
        image = Image.fromarray((np.asarray(image, np.int64) >> 8).clip(0, 255).astype(np.uint8))
    if max(image.size) > PICTURE_SIDE_MAX:
        image.thumbnail((PICTURE_SIDE_MAX, PICTURE_SIDE_MAX))
    if mode == "OPAQUE" or not clear:
        return image.convert("RGB"), "opaque"
    return image.convert("RGBA"), ALPHA_MODES.get(str(mode), "cutout")


def factor_color(linear: Any) -> NDArray[np.float64]:
    """(3,) sRGB, 0 to 255, of a material's linear RGB, 0 to 1."""
    shares = np.nan_to_num(np.asarray(linear, np.float64).ravel()[:3])
    return np.round(255 * np.clip(shares, 0, 1) ** (1 / 2.2))


def tinted(picture: Any, linear: Any) -> Any:
    """A picture times a material's linear RGBA, 0 to 1."""
    alpha = np.nan_to_num(np.asarray(linear, np.float64).ravel()[3:4])
    shares = [*factor_color(linear) / 255, *np.clip(alpha, 0, 1)]
    if len(shares) > 3 and shares[3] < 1:
        picture = picture.convert("RGBA")
    shares = shares[: len(picture.getbands())]
    shares += [1.0] * (len(picture.getbands()) - len(shares))
    return picture.point([round(share * byte) for share in shares for byte in range(256)])


def picture_bytes(picture: Any) -> bytes:
    """A picture as a file: JPEG, or PNG where it has alpha."""
    packed = io.BytesIO()
    if picture.mode == "RGBA":
        picture.save(packed, "PNG")
    else:
        picture.save(packed, "JPEG", quality=JPEG_QUALITY, subsampling=0)
    return packed.getvalue()


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
    data = read_bytes(path, FileKind("a mesh", max_bytes, error))
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
            numbers = [tuple(map(float, row)) for row in CORNER.findall(data)]
        except ValueError:
            raise error.about(path, found="words that are no numbers", allowed="an .stl") from None
        points = np.array(numbers[: len(numbers) // 3 * 3], np.float64).reshape(-1, 3)
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
