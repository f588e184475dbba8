"""Where the skin lies on its texture: MakeHuman's islands, laid out anew so that the face, which
people look at, gets its share.

The head's island is turned upright and stretched along each axis by a monotone map that gives the
face more than twice the density of the skull. The neck lies in a band below it, the eye sockets
on one patch in a corner that the island leaves free.
"""

from __future__ import annotations

import numpy as np

SOURCE_PX = 2048
"""MakeHuman's skins, whose pixels the numbers below count, from the top left."""
LEFT, TOP, LENGTH, DEPTH = 1290, 340, 1460, 758
"""The head's island: it lies on its side, its crown to the left."""
FACE_X, FACE_Y = (545, 915, 2.6), (300, 690, 2.2)
"""The face upright: first and last pixel, and how much denser it is drawn."""
SOFT_PX = 25
HEAD_SHARE = 0.80
"""Of the atlas' height; the neck lies below."""
NECK_X, NECK_Y = (500, 1060), (40, 350)
GAP = 0.004
PATCH = (0.02, 0.98)
"""Eye sockets: the middle of a patch that is `PATCH_HALF` wide on each side."""
PATCH_HALF = 0.018
SOCKET_X, MOUTH_Y = 400, 1790
"""Eye sockets lie left of this on the source, the inner mouth below that."""


def _stretch(length: int, face: tuple[float, float, float], total: float):
    """Pixels 0..length and their places 0..total, denser within the face."""
    first, last, gain = face
    t = np.arange(length + 1)
    inside = 1 / (1 + np.exp(-(t - first) / SOFT_PX)) / (1 + np.exp((t - last) / SOFT_PX))
    density = 1 + (gain - 1) * inside
    place = np.r_[0, np.cumsum((density[1:] + density[:-1]) / 2)]
    return t, place * total / place[-1]


_X = _stretch(LENGTH, FACE_X, 1.0)
_Y = _stretch(DEPTH, FACE_Y, HEAD_SHARE - GAP)


def atlas_uv(uv: np.ndarray) -> np.ndarray:
    """(n, 2) texture coordinates of the atlas from MakeHuman's, both from the bottom left."""
    px, py = uv[:, 0] * SOURCE_PX, (1 - uv[:, 1]) * SOURCE_PX
    x = np.interp(TOP + LENGTH - py, *_X)
    y = np.interp(px - LEFT, *_Y)
    neck = (py < TOP) & (px < LEFT)
    x = np.where(neck, (px - NECK_X[0]) / (NECK_X[1] - NECK_X[0]), x)
    down = (py - NECK_Y[0]) / (NECK_Y[1] - NECK_Y[0])
    y = np.where(neck, HEAD_SHARE + down * (1 - HEAD_SHARE), y)
    atlas = np.stack([x, 1 - y], 1)
    socket = (py > 2 * TOP) & (px < SOCKET_X)
    spread = np.stack([px / SOCKET_X, (py / SOURCE_PX * 4) % 1], 1) - 0.5
    atlas[socket] = (np.array(PATCH) + spread * PATCH_HALF)[socket]
    mouth = (py > MOUTH_Y) & (px > SOCKET_X)
    if mouth.any():  # a square of its own, for an image of its own
        inner = uv[mouth]
        size = np.maximum(np.ptp(inner, axis=0).max(), 1e-9)
        atlas[mouth] = (inner - inner.min(0)) / size * 0.98 + 0.01
    return np.clip(atlas, 0, 1)


def source_pixels(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Row and column (size, size) on MakeHuman's skin of every pixel of the atlas."""
    at = (np.arange(size) + 0.5) / size
    upright_x, upright_y = np.interp(at, _X[1], _X[0]), np.interp(at, _Y[1], _Y[0])
    column = LEFT + np.repeat(upright_y[:, None], size, 1)
    row = np.repeat((TOP + LENGTH - upright_x)[None], size, 0)
    below = at > HEAD_SHARE - GAP / 2
    neck_column = NECK_X[0] + at * (NECK_X[1] - NECK_X[0])
    neck_row = NECK_Y[0] + (at - HEAD_SHARE) / (1 - HEAD_SHARE) * (NECK_Y[1] - NECK_Y[0])
    column[below], row[below] = neck_column, neck_row[below][:, None]
    return row - 0.5, column - 0.5


def socket_patch(size: int) -> np.ndarray:
    """(size, size) True on the patch of the eye sockets."""
    at = (np.arange(size) + 0.5) / size
    wide = np.abs(at - PATCH[0]) < 1.5 * PATCH_HALF
    high = np.abs(1 - at - PATCH[1]) < 1.5 * PATCH_HALF
    return high[:, None] & wide[None]
