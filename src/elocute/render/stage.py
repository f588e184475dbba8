"""The stage of a picture: lights, ground, and how finely it is drawn."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from elocute.render.lights import RIGS, Rig

SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software")


@dataclass(frozen=True)
class Profile:
    """How finely pictures are drawn."""

    # Drawn this much larger, then reduced; up to 1 edges are smoothed instead. OpenGL alone draws
    # larger.
    oversampling: float
    shadow_side: int  # pixels of the blurred shadow map
    image_side: int  # images are reduced to this many pixels a side
    anisotropy: float  # samples of an image on what is seen aslant
    blended_levels: bool  # whether images are blended between two of their levels
    # whether hair is lit at its vertices, not pixel by pixel: its ribbons lie many deep. OpenGL
    # alone does it.
    hair_at_vertices: bool


PROFILES = {
    "draft": Profile(0.6, 192, 512, 1.0, False, True),
    "fast": Profile(1.0, 192, 1024, 1.0, False, True),
    "high": Profile(2.0, 512, 4096, 8.0, True, False),
}


@dataclass(frozen=True)
class Stage:
    """Lights, ground and quality of pictures.

    Parameters
    ----------
    rig : Rig
        Lights and the ground's own colours.
    quality : str
        "auto", "draft", "fast" or "high".
    backdrop : (height, width, 3) uint8, optional
        What lies behind the head instead of the rig's ground; a single pixel is one colour.
    transparent : bool
        Whether nothing lies behind it: pictures then have a fourth channel.
    """

    rig: Rig = RIGS["studio"]
    quality: str = "auto"
    backdrop: NDArray[np.uint8] | None = None
    transparent: bool = False

    @property
    def profile(self) -> Profile:
        return PROFILES["fast" if self.quality == "auto" else self.quality]

    def for_driver(self, name: str) -> Stage:
        """With the quality settled: high on a graphics card."""
        if self.quality != "auto":
            return self
        soft = any(word in name.lower() for word in SOFTWARE)
        return replace(self, quality="fast" if soft else "high")

    def backdrop_for(self, size: tuple[int, int]) -> NDArray[np.uint8]:
        """(height, width, 3) of the backdrop, cut to the picture's shape."""
        assert self.backdrop is not None
        wide, high = size
        rows, columns = self.backdrop.shape[:2]
        if (columns, rows) == size:
            return self.backdrop
        from PIL import Image

        scale = min(columns / wide, rows / high)
        w, h = wide * scale, high * scale
        box = ((columns - w) / 2, (rows - h) / 2, (columns + w) / 2, (rows + h) / 2)
        image = Image.fromarray(self.backdrop).resize(size, Image.Resampling.LANCZOS, box=box)
        return np.asarray(image)
