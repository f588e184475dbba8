"""One part of a mesh: the triangles of one material, with what colours them."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

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


def picture_bytes(picture: Any) -> bytes:
    """A picture as a file: JPEG, or PNG where it has alpha."""
    packed = io.BytesIO()
    if picture.mode == "RGBA":
        picture.save(packed, "PNG")
    else:
        picture.save(packed, "JPEG", quality=JPEG_QUALITY, subsampling=0)
    return packed.getvalue()
