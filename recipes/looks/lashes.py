"""Lashes, hair by hair, on bands along the edges of the lids."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from PIL import Image, ImageDraw
from scipy.spatial import KDTree

from recipes.head.face import NeutralFace
from recipes.looks.cards import Cards

WIDTH_PX, HEIGHT_PX, FINER = 768, 256, 3
"""Size of the picture: lashes of the upper lid in its upper half, of the lower in its lower."""
ROWS, COLUMNS = 5, 25
NEIGHBOURS = 10
PLATE_M = 0.004
"""How far the plate of the lower lid reaches down."""


@dataclass(frozen=True)
class Lid:
    """Lashes of one lid.

    Parameters
    ----------
    upper : bool
    length_mm : float
        Of the longest.
    by_place : tuple of float
        Lengths by the longest, at equal shares of the way from the nose outwards.
    ahead, up, curl : float
        Direction of a root, forwards and upwards, and how far it turns upwards to its tip, radians.
    fan : float
        How far they point away from the middle of the eye.
    hairs : int
    strong : float
        How dark the darkest are, 0..1.
    thick : tuple of float
        Of the thinnest and the thickest, pixels of the picture that is drawn.
    tufted, bowed : float
        How far tips come to the middle of their tuft, and how far hairs bend aside.
    """

    upper: bool
    length_mm: float
    by_place: tuple[float, ...]
    ahead: float
    up: float
    curl: float
    fan: float
    hairs: int
    strong: float
    thick: tuple[float, float]
    tufted: float = 0.30
    bowed: float = 0.006


UPPER = Lid(
    True, 7.9, (0.40, 0.62, 0.80, 0.92, 1.0, 1.0, 0.85), 1.0, 0.24, 0.85, 0.55, 250, 1.0, (3.4, 5.2)
)
LOWER = Lid(
    False,
    4.0,
    (0.35, 0.55, 0.75, 0.90, 1.0, 1.0, 0.8),
    0.9,
    -0.65,
    -0.35,
    0.40,
    120,
    0.7,
    (2.8, 4.2),
    tufted=0.18,
    bowed=0.0025,
)
PICTURES = {
    "lashes": (UPPER, LOWER),
    "sparse": (
        replace(UPPER, hairs=170, strong=0.85, thick=(2.9, 4.3)),
        replace(LOWER, hairs=80, strong=0.6, thick=(2.4, 3.6)),
    ),
}
"""Of the upper lid and the lower: full ones, and fewer and finer ones, as most men have."""


def cards(face: NeutralFace) -> tuple[Cards, np.ndarray]:
    """Both eyes' bands, and (vertex, NEIGHBOURS) skin that each turns with."""
    anatomy, skin = face.anatomy, face.skin
    parts, around = [], []
    for lid in (UPPER, LOWER):
        arc = anatomy.lid_arc(skin, lid.upper)
        arc = arc[np.argsort(np.abs(skin[arc, 0]))]
        index, weights, offset, uv = _band(skin, arc, face.assembly.eye_centre, lid)
        turns_with = edge_of(arc, NEIGHBOURS) if lid.upper else _plate(skin, arc)
        side = np.tile(turns_with, (len(index), 1))
        mirror = anatomy.skin_mirror
        parts += [(index, weights, offset, uv, False)]
        parts += [(mirror[index], weights, offset * [-1, 1, 1], uv, True)]
        around += [side, mirror[side]]
    grid = np.arange(COLUMNS * ROWS).reshape(COLUMNS, ROWS)
    quads = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], -1)
    quads = quads.reshape(-1, 4)
    all_quads = [
        (quads[:, ::-1] if turned else quads) + k * grid.size
        for k, (*_, turned) in enumerate(parts)
    ]
    index, weights, offset, uv = (np.vstack([part[k] for part in parts]) for k in range(4))
    points = np.einsum("vk,vkc->vc", weights, skin[index]) + offset
    faces = np.vstack(all_quads)
    whole = Cards(index, weights, offset, faces, uv, faces, np.ones(len(points)), points)
    return whole, np.vstack(around)


def _band(
    skin: np.ndarray, arc: np.ndarray, eye: np.ndarray, lid: Lid
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Mixtures, offsets (m) and texture coordinates of the left eye's band, column by column."""
    way = np.linspace(0, len(arc) - 1, COLUMNS)
    first = np.minimum(way.astype(int), len(arc) - 2)
    share = way - first
    nearer = share < 0.5
    index = np.stack([arc[first], arc[first + 1]], 1)
    weights = np.stack([1 - share, share], 1)
    # The nearer comes first: it is what the band turns with.
    index = np.where(nearer[:, None], index, index[:, ::-1])
    weights = np.where(nearer[:, None], weights, weights[:, ::-1])
    root = np.einsum("vk,vkc->vc", weights, skin[index])
    away = (root[:, 0] - eye[0]) / np.abs(root[:, 0] - eye[0]).max()
    t = way / way[-1]
    length = lid.length_mm / 1000 * np.interp(t, np.linspace(0, 1, len(lid.by_place)), lid.by_place)
    along = np.linspace(0, 1, ROWS)
    angle = np.arctan2(lid.up, lid.ahead) + lid.curl * along
    step = np.stack([np.zeros(ROWS), np.sin(angle), np.cos(angle)], -1)[None]
    step = step + np.array([1.0, 0, 0]) * lid.fan * away[:, None, None]
    step = step / np.linalg.norm(step, axis=-1, keepdims=True)
    path = np.cumsum(step, axis=1) - step[:, :1]
    offset = path / (ROWS - 1) * length[:, None, None]
    low = 0.5 if lid.upper else 0.0
    uv = np.stack(np.broadcast_arrays(t[:, None], low + 0.01 + 0.48 * along[None]), -1)
    many = np.repeat(index, ROWS, 0), np.repeat(weights, ROWS, 0)
    return *many, offset.reshape(-1, 3), uv.reshape(-1, 2)


def edge_of(arc: np.ndarray, count: int) -> np.ndarray:
    """(count,) skin along the edge of a lid. All its lashes turn with the whole edge, as a lid
    turns round the ball: beside a single root skin is wrung as the lid shuts, and so would the
    lashes be."""
    return arc[np.round(np.linspace(0, len(arc) - 1, count)).astype(int)]


def _plate(skin: np.ndarray, arc: np.ndarray) -> np.ndarray:
    """(NEIGHBOURS,) skin along the edge of the lower lid, and below it: where the cheek pushes the
    lid up, the edge stays as steep as it was, but the skin before which lashes lie bulges."""
    edge = edge_of(arc, NEIGHBOURS // 2)
    below = KDTree(skin).query(skin[edge] - [0, PLATE_M, 0])[1]
    return np.r_[edge, below]


def picture(lids: tuple[Lid, Lid]) -> np.ndarray:
    """(HEIGHT_PX, WIDTH_PX, 4): white hairs, to be tinted, and their alpha; roots below."""
    rng = np.random.default_rng(9)
    alpha = Image.new("L", (WIDTH_PX * FINER, HEIGHT_PX * FINER))
    draw = ImageDraw.Draw(alpha)
    for lid in lids:
        _drawn(draw, lid, rng)
    small = np.asarray(alpha.resize((WIDTH_PX, HEIGHT_PX), Image.Resampling.BOX), float) / 255
    white = np.ones_like(small)
    return np.dstack([white, white, white, np.clip(1.5 * small, 0, 1)])


def _drawn(draw: ImageDraw.ImageDraw, lid: Lid, rng: np.random.Generator) -> None:
    across, high = WIDTH_PX * FINER, HEIGHT_PX * FINER // 2
    floor = high if lid.upper else 2 * high
    t = np.linspace(0, 1, 14)
    places = (np.arange(lid.hairs) + rng.uniform(-0.3, 1.3, lid.hairs)) / lid.hairs
    roots = np.sort(0.02 + 0.965 * places.clip(0, 1))
    # Tips of neighbours meet in tufts.
    tufts = np.sort(rng.uniform(0.02, 1.0, lid.hairs // 3))
    for root in roots:
        tuft = tufts[np.abs(tufts - root).argmin()]
        tip = root + lid.tufted * (tuft - root) + 0.012 * (root - 0.35) + 0.004 * rng.normal()
        bow = lid.bowed * rng.normal()
        x = across * (root + (tip - root) * t**1.3 + bow * np.sin(np.pi * t))
        y = floor - high * 0.97 * rng.uniform(0.55, 1.0) * t
        strong = lid.strong * rng.uniform(0.75, 1.0)
        thick = rng.uniform(*lid.thick)
        for k, (a, b) in enumerate(pairwise(zip(x, y, strict=True))):
            wide = thick * (1 - t[k]) ** 0.8
            # No line is thinner than a pixel: it is paler instead.
            fill = round(255 * strong * min(wide, 1))
            draw.line([*a, *b], fill=fill, width=max(1, round(wide)))
