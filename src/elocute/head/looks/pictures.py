"""Decodes and encodes Elocute's own pictures."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray

JPEG_QUALITY = 93


def decoded(encoded: bytes) -> NDArray[np.uint8]:
    """(row, column, 3) sRGB of one of our own pictures (JPEG, WebP, PNG)."""
    from PIL import Image

    with Image.open(io.BytesIO(encoded)) as picture:
        return np.asarray(picture.convert("RGB"))


def jpeg(values: NDArray[np.uint8]) -> bytes:
    """(row, column, 3) sRGB as JPEG without subsampled colour."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(values).save(file, "JPEG", quality=JPEG_QUALITY, subsampling=0)
    return file.getvalue()
