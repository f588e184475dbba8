"""Values of images between their pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array, FloatArray


def bilinear(image: FloatArray, at: FloatArray, *, repeat: bool = True) -> Float32Array:
    """(point, channel) of an image (height, width, channel) at (point, 2) 0…1 from its first row.

    Beyond the edge the image repeats, or goes on as its last row and column.
    """
    high, wide = image.shape[:2]
    x = at[:, 0] * np.float32(wide) - np.float32(0.5)
    y = at[:, 1] * np.float32(high) - np.float32(0.5)
    left, low = np.floor(x), np.floor(y)
    share_x, share_y = (x - left)[:, None], (y - low)[:, None]
    columns, rows = left.astype(np.int32), low.astype(np.int32)

    def inside(index: NDArray[np.int32], side: int) -> NDArray[np.int32]:
        return index % side if repeat else np.clip(index, 0, side - 1)

    x0, x1 = inside(columns, wide), inside(columns + 1, wide)
    y0, y1 = inside(rows, high) * wide, inside(rows + 1, high) * wide
    flat = image.reshape(high * wide, -1)
    bottom = flat[y0 + x0] * (1 - share_x) + flat[y0 + x1] * share_x
    top = flat[y1 + x0] * (1 - share_x) + flat[y1 + x1] * share_x
    return (bottom * (1 - share_y) + top * share_y).astype(np.float32)
