"""Images of surfaces and of what lies behind a head: opened within limits, sampled in NumPy."""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array, FloatArray
from elocute.errors import InputError
from elocute.meshes.mesh_file import PICTURE_FORMATS, check_picture
from elocute.numerics.image_sampling import bilinear
from elocute.render.shading import to_linear

Pixels = NDArray[np.uint8]
_LINEAR = to_linear(np.arange(256, dtype=np.float32) / 255)


@dataclass(frozen=True)
class Image:
    """A decoded image.

    Parameters
    ----------
    pixels : (height, width, 4) uint8
        As stored, the top row first.
    srgb : bool
        Whether red, green and blue are sRGB, not linear.
    """

    pixels: NDArray[np.uint8]
    srgb: bool

    @cached_property
    def levels(self) -> list[Float32Array]:
        """(height, width, 4) linear 0…1, bottom row first; each level half as large."""
        scale = np.full((4, 256), np.arange(256) / 255, np.float32)
        if self.srgb:
            scale[:3] = _LINEAR
        level = np.stack([scale[c][self.pixels[::-1, :, c]] for c in range(4)], axis=2)
        levels = [level]
        while min(level.shape[:2]) > 1:
            high, wide = (side // 2 * 2 for side in level.shape[:2])
            even = level[:high, :wide].reshape(high // 2, 2, wide // 2, 2, 4)
            levels.append(level := even.mean(axis=(1, 3)))
        return levels

    def texels(self, at: FloatArray, level: int = 0) -> Float32Array:
        """(point, 4) linear values at texture coordinates (point, 2), between four texels."""
        image = self.levels[min(max(level, 0), len(self.levels) - 1)]
        return bilinear(image, at)

    def at_density(self, at: FloatArray, density: FloatArray) -> Float32Array:
        """As `texels`, from levels at which a texel is about a pixel.

        density (point,) is how far texture coordinates go in a pixel.
        """
        side = max(self.pixels.shape[:2])
        levels = np.log2(np.maximum(density * side, 1)).round().astype(np.int32)
        levels = np.minimum(levels, len(self.levels) - 1)
        out = np.empty((len(at), 4), np.float32)
        for level in np.unique(levels):
            chosen = levels == level
            out[chosen] = self.texels(at[chosen], level)
        return out


def open_pixels(data: bytes, what: str | Path, side_max: int, error: type[InputError]) -> Pixels:
    """Pixels of an image file; its size is checked before memory is taken.

    Parameters
    ----------
    data : bytes
        PNG, JPEG or WebP.
    what : str or Path
        What messages call it.
    side_max : int
        A larger image is reduced to this many pixels on its longer side.
    error : type of InputError
        What is raised.

    Returns
    -------
    (height, width, 4) uint8

    Raises
    ------
    InputError
        An `error` for what is no image or too large a one.
    """
    from PIL import Image as Pillow

    wide, high = check_picture(data, what, error)
    try:
        with Pillow.open(io.BytesIO(data), formats=PICTURE_FORMATS) as image:
            bands = image.convert("RGBA").split()
    except Exception as problem:  # Pillow's parsers raise of every kind
        raise error.about(what, found="a broken picture", allowed="a whole one") from problem
    largest = max(wide, high)
    if largest > side_max:
        # Each band by itself: Pillow would turn what is clear black, and fringes with it.
        size = (max(1, wide * side_max // largest), max(1, high * side_max // largest))
        bands = [band.resize(size, Pillow.Resampling.BOX) for band in bands]
    return np.stack([np.asarray(band) for band in bands], axis=2)
