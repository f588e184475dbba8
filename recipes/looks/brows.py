"""Brows drawn hair by hair on bands that lie on the brow ridge.

MakeHuman's brows are slabs whose square inner ends make every face frown. These begin softly,
rise to an arch at two thirds and end in a point; inner ends lie a little lower than the arch, as
on a face at ease.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from PIL import Image, ImageDraw

from recipes.head.attachments import under
from recipes.head.face import NeutralFace
from recipes.looks.canvas import blurred
from recipes.looks.cards import Cards

COLUMNS, ROWS = 22, 7
BAND_MM, OFF_MM = 15.0, 0.35
"""Height of the band, and how far off the skin it lies."""
WIDTH_PX, HEIGHT_PX, FINER = 768, 192, 3


@dataclass(frozen=True)
class Brow:
    """A shape of brow; millimetres on the mean face, heights over the eyes' centres.

    `start` and `end` lie across from the middle of the face; `inner`, `arch` and `tail` are the
    heights of its middle line; `arch_at` is where along it the arch is; `thick` its width where it
    is widest; `hairs` how many there are, `length` and `width` theirs; `wild` how far they stray.
    """

    start: float = 12.5
    end: float = 50.5
    inner: float = 16.4
    arch: float = 21.0
    tail: float = 15.8
    arch_at: float = 0.62
    thick: float = 7.0
    hairs: int = 700
    length: float = 7.5
    width: float = 0.15
    wild: float = 1.0
    ground: float = 0.24


STYLES = {
    "natural": Brow(),
    "straight": Brow(
        inner=16.6, arch=19.4, tail=15.6, arch_at=0.66, thick=7.0, hairs=620, length=8.2, wild=1.1
    ),
    "full": Brow(
        start=11.5, inner=16.6, arch=20.4, tail=15.6, thick=8.0, hairs=720, length=9.0,
        width=0.155, wild=1.4, ground=0.28,
    ),
    "fine": Brow(
        start=14.0, inner=17.0, arch=21.8, tail=16.2, thick=4.6, hairs=480, length=5.6, width=0.13,
        wild=0.7, ground=0.20,
    ),
    "arched": Brow(
        inner=16.4, arch=22.6, tail=15.8, arch_at=0.66, thick=6.2, hairs=640, length=6.8, wild=0.8
    ),
    "soft": Brow(thick=6.4, arch=20.6, hairs=640, length=7.0, width=0.14, ground=0.22),
}  # fmt: skip


def middle_line(brow: Brow, t: np.ndarray) -> np.ndarray:
    """Height of the middle line, mm, at shares of its way (0 inner, 1 outer)."""
    rise = np.clip(t / brow.arch_at, 0, 1)
    fall = np.clip((t - brow.arch_at) / (1 - brow.arch_at), 0, 1)
    up = brow.inner + (brow.arch - brow.inner) * np.sin(rise * np.pi / 2) ** 1.25
    return up + (brow.tail - brow.arch) * (1 - np.cos(fall * np.pi / 2)) ** 1.15


def thickness(brow: Brow, t: np.ndarray) -> np.ndarray:
    return brow.thick * np.interp(
        t, [0, 0.08, 0.22, 0.45, 0.62, 0.8, 1], [0.62, 0.86, 1.0, 0.94, 0.80, 0.58, 0.30]
    )


def cards(face: NeutralFace, brow: Brow) -> Cards:
    """Two bands on the skin, mirror images of each other, with one picture."""
    anatomy, skin = face.anatomy, face.skin
    eye = face.assembly.eye_centre[1]
    t = np.linspace(-0.06, 1.06, COLUMNS)
    across = np.linspace(0.5, -0.5, ROWS)
    x = brow.start + (brow.end - brow.start) * t
    middle = middle_line(brow, t.clip(0, 1))
    index, weights, offset, uv = [], [], [], []
    for column in range(COLUMNS):
        for row in range(ROWS):
            place = np.array([x[column], middle[column] + BAND_MM * across[row]]) / 1000
            mixture, outward = under(anatomy, skin, place + np.array([0, eye]))
            index.append(list(mixture))
            weights.append(list(mixture.values()))
            offset.append(outward * OFF_MM / 1000)
            uv.append([column / (COLUMNS - 1), 1 - row / (ROWS - 1)])
    grid = np.arange(COLUMNS * ROWS).reshape(COLUMNS, ROWS)
    quads = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], -1).reshape(
        -1, 4
    )
    left, share, off = np.array(index), np.array(weights), np.array(offset)
    both = np.vstack([left, anatomy.skin_mirror[left]])
    shares, offsets = np.vstack([share, share]), np.vstack([off, off * [-1, 1, 1]])
    count = len(left)
    return Cards(
        both,
        shares,
        offsets,
        np.vstack([quads, quads[:, ::-1] + count]),
        np.vstack([uv, uv]),
        np.vstack([quads, quads[:, ::-1] + count]),
        np.ones(2 * count),
        np.einsum("vk,vkc->vc", shares, skin[both]) + offsets,
    )


def picture(brow: Brow, seed: int) -> np.ndarray:
    """(HEIGHT_PX, WIDTH_PX, 4) 0..1: grey hairs and their alpha, inner end at the left."""
    rng = np.random.default_rng(seed)
    size = (WIDTH_PX * FINER, HEIGHT_PX * FINER)
    alpha, tone = Image.new("L", size, 0), Image.new("L", size, 130)
    draw, paint = ImageDraw.Draw(alpha), ImageDraw.Draw(tone)
    long = (brow.end - brow.start) * 1.12
    lead = np.array([0.06 * long / 1.12, 0.0])
    scale = np.array([size[0] / long, size[1] / BAND_MM])
    for t, side in _roots(brow, rng):
        hair = _hair(brow, t, side, rng)
        bright = int(rng.uniform(90, 240))
        strong = int(
            255
            * rng.uniform(0.6, 1.0)
            * np.interp(t, [-0.02, 0.08, 0.24, 0.38, 0.72, 0.95], [0.15, 0.45, 0.8, 1, 0.9, 0.4])
        )
        points = (hair + lead) * scale
        points[:, 1] = size[1] / 2 - points[:, 1]
        fine = np.interp(t, [0, 0.25], [0.55, 1])
        thick = brow.width * scale[0] * fine * rng.uniform(0.7, 1.3)
        for k, (a, b) in enumerate(pairwise(points)):
            wide = max(1, round(thick * (1 - 0.9 * k / len(points))))
            draw.line([*a, *b], fill=strong, width=wide)
            paint.line([*a, *b], fill=bright, width=wide)
    down = (WIDTH_PX, HEIGHT_PX)
    hairs = np.asarray(alpha.resize(down, Image.Resampling.BOX), float) / 255
    grey = np.asarray(tone.resize(down, Image.Resampling.BOX), float) / 255
    solid = np.maximum(hairs, brow.ground * _shadow(brow))
    return np.dstack([grey, grey, grey, solid])


def _roots(brow: Brow, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Where hairs stand: share of the way, and side of the middle line from -1 to 1."""
    roots = []
    while len(roots) < brow.hairs:
        t, side = rng.uniform(-0.02, 0.94), rng.uniform(-1, 1)
        here = np.interp(t, [-0.02, 0.05, 0.2, 0.36, 0.7, 0.94], [0.14, 0.44, 0.80, 1, 0.9, 0.28])
        if rng.random() < here * (1 - 0.45 * abs(side) ** 3):
            roots.append((t, side))
    return sorted(roots, key=lambda root: -root[0])


def _hair(brow: Brow, t: float, side: float, rng: np.random.Generator) -> np.ndarray:
    """(6, 2) mm along and over the middle line: upright at the inner end, then outwards, those
    above the line bending down to it and those below up."""
    thick = float(thickness(brow, np.array(max(t, 0))))
    along = t * (brow.end - brow.start)
    root = np.array([along, side * 0.46 * thick])
    lean = np.interp(t, [0, 0.1, 0.25, 0.5, 1], [74, 60, 38, 20, 6])
    angle = np.radians(lean - side * np.interp(t, [0, 0.3, 1], [6, 24, 12]))
    angle += np.radians(np.interp(t, [0, 0.3], [9, 8])) * brow.wild * rng.normal()
    bend = np.radians(np.interp(t, [0, 0.3, 1], [-34, -26, -10]) * rng.uniform(0.6, 1.2))
    length = (
        brow.length * rng.uniform(0.65, 1.1) * np.interp(t, [0, 0.15, 0.7, 1], [0.7, 1, 0.85, 0.45])
    )
    steps = np.linspace(0, 1, 6)[1:]
    turn = angle + bend * steps
    moves = np.stack([np.cos(turn), np.sin(turn)], 1) * length / 5
    path = np.vstack([root, root + np.cumsum(moves, 0)])
    limit = 0.62 * thick + 0.5
    path[:, 1] = np.clip(path[:, 1], -limit, limit)
    return path


def _shadow(brow: Brow) -> np.ndarray:
    """(HEIGHT_PX, WIDTH_PX) 0..1: what lies between the hairs."""
    t = np.linspace(-0.06, 1.06, WIDTH_PX)
    y = np.abs(np.linspace(0.5, -0.5, HEIGHT_PX))[:, None] * BAND_MM
    half = 0.40 * thickness(brow, t.clip(0, 1))
    inside = np.clip((half[None] - y) / 0.8 + 0.5, 0, 1)
    ends = np.interp(t, [0.06, 0.4, 0.85, 1.0], [0, 1, 0.9, 0])
    return blurred(inside * ends[None], 5.0)
