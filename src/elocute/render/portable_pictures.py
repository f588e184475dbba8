"""Converts pictures of a head to PNG and JPEG, which every program opens."""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from elocute.errors import HeadError
from elocute.head.surface import Surface
from elocute.meshes.mesh_file import check_picture

MEDIA = {"PNG": "image/png", "JPEG": "image/jpeg"}
SUFFIXES = {"image/png": ".png", "image/jpeg": ".jpg"}
QUALITY = 90
COLOR_ERROR = 2  # of 255, between the channels of a grey picture that was coded as colours


@dataclass(frozen=True)
class PortablePicture:
    """An encoded picture."""

    data: bytes
    media: str  # "image/png" or "image/jpeg"
    size: tuple[int, int]  # width and height, pixels
    made_from: str = ""  # the format that it was encoded anew from; empty where it is as it was

    @property
    def suffix(self) -> str:
        """ ".png" or ".jpg"."""
        return SUFFIXES[self.media]


@lru_cache(maxsize=48)
def portable_picture(
    data: bytes, subject: str, clear: bool = False, grey: bool = False
) -> PortablePicture:
    """A picture as PNG or JPEG; what is neither is encoded anew.

    data: a PNG, JPEG or WebP file; subject: what it is of, for messages; clear: whether its alpha
    is wanted, so that it becomes a PNG; grey: whether a clear one without colours may be stored as
    grey and alpha, half as large. Raises HeadError for anything but a picture.
    """
    from PIL import Image

    size = check_picture(data, subject, HeadError)
    with Image.open(io.BytesIO(data)) as picture:
        kind = picture.format or ""
        if kind in MEDIA and not (clear and kind == "JPEG"):
            return PortablePicture(data, MEDIA[kind], size)
        packed, media = _encoded(picture, subject, clear, grey)
    return PortablePicture(packed, media, size, kind)


def material_picture(
    surface: Surface, kind: str, material: str, grey: bool = False
) -> PortablePicture | None:
    """The image "color", "normal", … of a surface; None where it has none. Raises HeadError."""
    data = getattr(surface, kind)
    clear = kind == "color" and surface.opacity != "opaque"
    subject = f"{kind} of the material {material!r}"
    return portable_picture(data, subject, clear, grey) if data else None


def _encoded(picture: Any, subject: str, clear: bool, grey: bool) -> tuple[bytes, str]:
    """The bytes of an open picture, and their media type. Raises HeadError."""
    file = io.BytesIO()
    try:
        if clear:
            picture = picture.convert("RGBA")
            picture = picture.convert("LA") if grey and _colorless(picture) else picture
            picture.save(file, "PNG")
        else:
            picture.convert("RGB").save(file, "JPEG", quality=QUALITY, subsampling=0)
    except (OSError, ValueError, SyntaxError) as problem:  # cut short, or not what it says
        raise HeadError.about(subject, found=f"a picture that is damaged ({problem})") from problem
    return file.getvalue(), MEDIA["PNG" if clear else "JPEG"]


def _colorless(picture: Any) -> bool:
    """Whether red, green and blue are alike in an RGBA picture, but for a coder's error."""
    import numpy as np

    color = np.asarray(picture)[..., :3].astype(np.int16)
    return bool(np.ptp(color, axis=-1).max() <= COLOR_ERROR)
