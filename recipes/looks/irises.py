"""Eyes as circles round their axis: iris, limbus, and a sclera that is not white."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.ndimage as ndimage
from PIL import Image

from recipes.head.eyeball import IRIS_RAD
from recipes.head.paint import EYE_TEXTURE_RAD
from recipes.looks.canvas import noise

SIZE = 512
CENTRE, IRIS_RADIUS, BALL_RADIUS = (0.2847, 0.7048), 0.1215, 0.29
"""Where MakeHuman's pictures hold the left eye, as shares of their size."""
PUPIL_RAD, PUPIL_EDGE_RAD = 0.135, 0.03
SCLERA = (0.86, 0.825, 0.80)
RECOLOURED = {"brown": (1.05, 1.95, 2.2)}
"""MakeHuman's brown is a dark red."""


def eye(path: Path) -> np.ndarray:
    """(SIZE, SIZE, 3) sRGB: the angle from the axis grows from the middle to the edge."""
    y, x = (np.mgrid[0:SIZE, 0:SIZE] + 0.5) / SIZE * 2 - 1
    angle, around = np.hypot(x, y) * EYE_TEXTURE_RAD, np.arctan2(y, x)
    painted = _unwrapped(path, angle, around)
    inside = np.clip((IRIS_RAD - angle) / 0.035 + 0.5, 0, 1)[..., None]
    colour = np.array(RECOLOURED.get(path.stem.removesuffix("_eye"), (1.0, 1.0, 1.0)))
    iris = _iris(painted * colour, angle, y)
    return (_sclera(painted, angle) * (1 - inside) + iris * inside).clip(0, 1)


def _unwrapped(path: Path, angle: np.ndarray, around: np.ndarray) -> np.ndarray:
    picture = np.asarray(Image.open(path).convert("RGB"), float) / 255
    size = len(picture)
    beyond = (angle - IRIS_RAD) / (EYE_TEXTURE_RAD - IRIS_RAD)
    radius = np.where(
        angle < IRIS_RAD,
        angle / IRIS_RAD * IRIS_RADIUS,
        IRIS_RADIUS + beyond * (0.93 * BALL_RADIUS - IRIS_RADIUS),
    )
    rows = (CENTRE[1] + radius * np.sin(around)) * size
    columns = (CENTRE[0] + radius * np.cos(around)) * size
    channels = [
        ndimage.map_coordinates(picture[..., k], [rows, columns], order=1, mode="nearest")
        for k in range(3)
    ]
    return np.stack(channels, -1)


def _sclera(painted: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Evenly lit off-white, redder away from the iris, a trace of the painted veins."""
    white = 0.7 * painted + 0.3 * np.array([0.84, 0.80, 0.77])
    white = white * np.array(SCLERA) / np.median(white[angle > 0.6], axis=0)
    red = np.clip((angle - 0.62) / 0.6, 0, 1)[..., None]
    return white * (1 - red * [0.10, 0.27, 0.27])


def _iris(painted: np.ndarray, angle: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Fibres with the painted colour, a dark soft limbus, light gathering below the middle."""
    grey = painted.mean(-1, keepdims=True)
    colour = 0.72 * painted + 0.28 * grey
    colour = colour * (0.80 + 0.45 * np.clip((y + 0.30) / 0.6, 0, 1))[..., None] * 1.05
    colour = colour * (1 + 0.04 * noise(5, SIZE, 1.0))[..., None]
    rim = np.exp(-(((angle - IRIS_RAD + 0.01) / 0.055) ** 2))[..., None]
    colour = colour * (1 - 0.60 * rim)
    pupil = np.clip((angle - PUPIL_RAD) / PUPIL_EDGE_RAD, 0, 1)[..., None]
    return colour * (0.03 + 0.97 * pupil)
