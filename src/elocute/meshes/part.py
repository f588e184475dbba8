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
    """Where a part of a glTF file comes from.

    Attributes
    ----------
    node, mesh, primitive : int
        Their numbers in the file; the primitive's in its mesh.
    rows : (vertex,) int64
        Which of the primitive's vertices these are.
    count : int
        Vertices of the primitive.
    linear : (vertex, 3, 3) float64
        From the primitive's own space to the scene's, at rest, shifts left out.
    """

    node: int
    mesh: int
    primitive: int
    rows: NDArray[np.int64]
    count: int
    linear: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MeshPart:
    """Triangles of one material.

    Attributes
    ----------
    name : str
        Of the mesh, or of its material.
    vertices : (vertex, 3) float64
        In the file's unit, where its scene puts them.
    triangles : (face, 3) int64
        Corners.
    uv : (vertex, 2) float64 or None
        Places in the picture, v upwards.
    picture : PIL.Image.Image or None
        The colour, in RGB or RGBA, of at most 2048 pixels a side.
    colors : (vertex, 3) uint8
        sRGB of the vertices, else of the material, else grey; a picture stands in for it.
    coloured : bool
        Whether the file says a colour.
    opacity : str
        "opaque", "cutout" or "blend".
    origin : PartOrigin or None
        Where in a glTF file it is.
    """

    name: str
    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    uv: NDArray[np.float64] | None
    picture: Any
    colors: NDArray[np.uint8]
    coloured: bool
    opacity: str
    origin: PartOrigin | None = None


def drawn_picture(image: Any, mode: Any) -> tuple[Any, str]:
    """A picture in RGB or RGBA of at most 2048 pixels a side, and how its alpha is meant.

    Parameters
    ----------
    image : PIL.Image.Image
        As it is in the file.
    mode : str or None
        OPAQUE, MASK or BLEND, where the material says so.
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
