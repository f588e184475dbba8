"""Spreads colours under empty pixels, for codecs that blur straight alpha."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

CELL = 8  # pixels a side


def spread_colours(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Give what is transparent the colour of what lies next to it.

    Codecs keep colours at half the size and blur them over edges: black beside hair would show as
    a dark seam wherever the video is laid over something light.

    Parameters
    ----------
    picture : (height, width, 4) uint8
        sRGB with straight alpha.

    Returns
    -------
    (height, width, 4) uint8
        The same where alpha is not 0, and the same alpha.
    """
    height, width = picture.shape[:2]
    rows, columns = -(-height // CELL), -(-width // CELL)
    padded = np.zeros((rows * CELL, columns * CELL, 4), np.float32)
    padded[:height, :width] = picture
    padded[..., :3] *= padded[..., 3:]
    sums = padded.reshape(rows, CELL, columns, CELL, 4).sum(axis=(1, 3))
    near = np.pad(sums, ((1, 1), (1, 1), (0, 0)))
    nine = [near[d : d + rows, r : r + columns] for d in range(3) for r in range(3)]
    around = np.sum(nine, axis=0)
    colours = around[..., :3] / np.maximum(around[..., 3:], 1)
    cells = np.clip(colours + 0.5, 0, 255).astype(np.uint8)
    fill = cells.repeat(CELL, axis=0).repeat(CELL, axis=1)[:height, :width]
    spread = picture.copy()
    empty = picture[..., 3] == 0
    spread[empty, :3] = fill[empty]
    return spread
