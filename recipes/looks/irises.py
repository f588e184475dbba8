"""Eyes as circles round their axis: iris, limbus, and a sclera that is not white.

All of it is drawn here, for light that comes from above and a little from the left; both eyes
have the same picture, seen from the front.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.ndimage as ndimage
from PIL import Image, ImageDraw

from elocute.head.looks.eyes import EDGE_RAD, IRIS_RAD, PUPIL_RAD as EDGE_OF_PUPIL_RAD
from elocute.numerics.smoothing import smoothstep
from recipes.looks.canvas import noise

SIZE, FINER = 512, 3
PUPIL_EDGE_RAD = 0.022
PUPIL_RAD = EDGE_OF_PUPIL_RAD - PUPIL_EDGE_RAD / 2
"""Where its edge begins."""
LIMBUS_RAD, LIMBUS_DARK = 0.05, 0.38
"""Over which the iris gives way to the white, and how dark its edge is."""
Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Iris:
    """Colours (sRGB) round the pupil, of most of it, and at its edge; contrast of the fibres."""

    inner: Colour
    middle: Colour
    outer: Colour
    fibres: float


IRISES = {
    "brown": Iris((0.37, 0.23, 0.13), (0.29, 0.18, 0.105), (0.13, 0.085, 0.06), 0.8),
    "brownlight": Iris((0.50, 0.34, 0.18), (0.41, 0.30, 0.18), (0.20, 0.145, 0.10), 0.9),
    "green": Iris((0.46, 0.37, 0.22), (0.37, 0.385, 0.29), (0.21, 0.24, 0.20), 1.0),
    "blue": Iris((0.46, 0.46, 0.42), (0.36, 0.43, 0.485), (0.19, 0.25, 0.31), 1.0),
    "lightblue": Iris((0.52, 0.53, 0.50), (0.455, 0.53, 0.58), (0.25, 0.33, 0.40), 1.0),
    "bluegreen": Iris((0.46, 0.43, 0.33), (0.38, 0.455, 0.445), (0.19, 0.26, 0.27), 1.0),
    "grey": Iris((0.54, 0.52, 0.47), (0.50, 0.53, 0.53), (0.25, 0.28, 0.30), 1.0),
    "ice": Iris((0.60, 0.62, 0.61), (0.59, 0.66, 0.70), (0.29, 0.36, 0.41), 1.0),
}
COLLARETTE, RUFF = 0.40, (0.45, 0.33, 0.25)
"""Where, between pupil and edge, the wreath of fibres lies; what the pupil's margin keeps."""
TOP, BELOW, GATHERED = 0.58, 1.10, 0.30
"""Light on the iris under the lid and at its lower edge; what the cornea gathers there."""
SCLERA, FAR_SCLERA = (0.885, 0.835, 0.795), (0.90, 0.76, 0.71)
"""The white round the iris, and where the lids hide it."""
FLESH = (1.0, 0.74, 0.68)
"""In the corners themselves."""
CORNERS, VESSELS = 0.85, (0.66, 0.28, 0.24)
VESSEL_COUNT, VESSEL_STRENGTH = 44, 0.42


def eye(name: str) -> np.ndarray:
    """(SIZE, SIZE, 3) sRGB: the angle from the axis grows from the middle to the edge."""
    y, x = (np.mgrid[0:SIZE, 0:SIZE] + 0.5) / SIZE * 2 - 1
    angle, around = np.hypot(x, y) * EDGE_RAD, np.arctan2(y, x)
    inside = _eased((IRIS_RAD - angle) / LIMBUS_RAD + 0.5)[..., None]
    iris = _iris(IRISES[name], angle, around)
    return (_sclera(angle, around) * (1 - inside) + iris * inside).clip(0, 1)


def _iris(iris: Iris, angle: np.ndarray, around: np.ndarray) -> np.ndarray:
    """Fibres round a wreath, a dark soft limbus, light that gathers below the middle."""
    out = ((angle - PUPIL_RAD) / (IRIS_RAD - PUPIL_RAD)).clip(0, 1)
    wreath = COLLARETTE + 0.06 * _round(31, out, around, (200, 16))
    colours = np.array([iris.inner, iris.middle, iris.outer])
    inner = _eased((wreath + 0.16 - out) / 0.32)[..., None]
    edge = _eased((out - 0.74) / 0.30)[..., None]
    colour = colours[1] + (colours[0] - colours[1]) * inner
    colour = colour + (colours[2] - colour) * edge
    fine = 0.6 * _round(32, out, around, (24, 2.2)) + 0.4 * _round(33, out, around, (12, 5.0))
    pits = np.maximum(_round(34, out, around, (7, 9.0)) - 0.9, 0) * _eased((out - 0.3) / 0.2)
    ring = np.exp(-(((out - wreath) / 0.07) ** 2))
    bright = 1 + iris.fibres * (0.115 * fine - 0.20 * pits * (1 - edge[..., 0]) + 0.10 * ring)
    bright *= 1 - 0.30 * np.exp(-((out / 0.10) ** 2))
    bright *= 1 - LIMBUS_DARK * _eased((out - 0.80) / 0.24)
    height = np.sin(around) * angle / IRIS_RAD  # 1 at the lower edge
    bright *= TOP + (BELOW - TOP) * _eased((height + 0.85) / 1.1)
    towards = np.cos(around - np.radians(70)).clip(0, 1) ** 2
    bright += GATHERED * towards * np.exp(-(((out - 0.66) / 0.24) ** 2))
    colour = colour * bright.clip(0.15, 2)[..., None]
    pupil = ((angle - PUPIL_RAD) / PUPIL_EDGE_RAD).clip(0, 1)[..., None]
    margin = np.exp(-(((out - 0.02) / 0.05) ** 2))[..., None]
    colour = colour * (1 - margin * (1 - np.array(RUFF)))
    return 0.02 + (colour - 0.02) * pupil


def _sclera(angle: np.ndarray, around: np.ndarray) -> np.ndarray:
    """Off-white, yellower here and there; pink and veined towards the corners."""
    corner = _eased((angle - 0.42) / 0.62) * (0.35 + 0.65 * np.cos(around) ** 2)
    colour = np.array(SCLERA) + CORNERS * corner[..., None] * np.subtract(FAR_SCLERA, SCLERA)
    flesh = (_eased((angle - 0.66) / 0.24) * np.cos(around) ** 2)[..., None]
    colour = colour + 0.9 * flesh * (np.array(FLESH) - colour)
    colour = colour * (1 + 0.012 * noise(35, SIZE, 18)[..., None] * np.array([0.4, 1.0, 1.6]))
    share = VESSEL_STRENGTH * _vessels()[..., None]
    colour = colour * (1 - share) + np.array(VESSELS) * share
    # The edge of the cornea lets the dark behind it through.
    rim = np.exp(-(((angle - IRIS_RAD) / 0.07) ** 2))[..., None]
    return colour * (1 - rim * [0.30, 0.26, 0.20])


def _vessels() -> np.ndarray:
    """(SIZE, SIZE) 0..1: thin, winding, forked, from the corners towards the iris."""
    rng = np.random.default_rng(36)
    drawn = Image.new("L", (SIZE * FINER, SIZE * FINER))
    draw = ImageDraw.Draw(drawn)
    for k in range(VESSEL_COUNT):
        start = np.pi * (k % 2) + rng.normal(0, 0.36)
        _vessel(draw, rng, 1.12, start, rng.uniform(0.48, 0.78), rng.uniform(0.4, 1.0), 2)
    small = drawn.resize((SIZE, SIZE), Image.Resampling.BOX)
    return ndimage.gaussian_filter(np.asarray(small, float) / 255, 0.6)


def _vessel(
    draw: ImageDraw.ImageDraw,
    rng: np.random.Generator,
    angle: float,
    around: float,
    end: float,
    strong: float,
    forks: int,
) -> None:
    """One vessel and its branches, paler inwards; angles as in `eye`."""
    steps = max(3, int((angle - end) / 0.03))
    turns = np.cumsum(rng.normal(0, 0.012, steps) + 0.02 * np.sin(np.arange(steps) * 1.3))
    way, turned = np.linspace(angle, end, steps), around + turns
    radius = way / EDGE_RAD * SIZE * FINER / 2
    middle = SIZE * FINER / 2
    points = np.stack([middle + radius * np.cos(turned), middle + radius * np.sin(turned)], 1)
    for k, (a, b) in enumerate(pairwise(points)):
        tone = round(255 * strong * (1 - 0.8 * k / steps))
        draw.line([*a, *b], fill=tone, width=max(1, round(3 * (1 - k / steps))))
    if forks:
        at = steps // 3 + int(rng.integers(0, max(1, steps // 3)))
        side = turned[at] + rng.choice([-1, 1]) * 0.03
        _vessel(draw, rng, way[at], side, end + 0.06, 0.6 * strong, forks - 1)


def _round(
    seed: int, out: np.ndarray, around: np.ndarray, sigma: tuple[float, float]
) -> np.ndarray:
    """Noise drawn out along the radius, of deviation 1; its size in cells of 128 by 1024."""
    rng = np.random.default_rng(seed)
    cells = rng.normal(size=(128, 1024))
    drawn = ndimage.gaussian_filter1d(cells, sigma[0], axis=0, mode="reflect")
    drawn = ndimage.gaussian_filter1d(drawn, sigma[1], axis=1, mode="wrap")
    sway = 4 * np.sin(5 * out + 3 * np.sin(around))  # fibres are not quite straight
    columns = (around / (2 * np.pi) % 1) * 1024 + sway
    return ndimage.map_coordinates(
        drawn / drawn.std(), [out * 127, columns], order=1, mode="grid-wrap"
    )


def _eased(share: np.ndarray) -> np.ndarray:
    return smoothstep(share.clip(0, 1))
