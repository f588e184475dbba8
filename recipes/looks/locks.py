"""Curls as ribbons that grow on the scalp: MakeHuman's hair has none."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from elocute.head.normals import vertex_normals
from recipes.looks.canvas import noise
from recipes.looks.cards import Cards, Fitting
from recipes.looks.strands import hairs
from recipes.looks.surface import Skin, subdivided, triangles, unit

CURL_PX, LANES = 512, 8
"""Size of the picture of curls, and how many locks stand in it side by side."""
BAND = 0.95
"""Width of a curl's ribbon by the radius."""
CAP_SHADE = 0.42
"""The shell under curls is dark."""


@dataclass(frozen=True)
class Curl:
    """How hair curls.

    Parameters
    ----------
    apart_m, edge_apart_m : float
        Distance of the roots: on top, and at the hairline, where curls are smaller.
    radius_m, edge_radius_m : float
        Radius of curls, likewise.
    rise_m : float
        How far a turn of a curl takes it on.
    turns : float
        Of a whole curl.
    steps : int
        Pairs of vertices along a ribbon.
    cap_m : float
        Under the curls lies a shell this far off the skin.
    """

    apart_m: float
    edge_apart_m: float
    radius_m: float
    edge_radius_m: float
    rise_m: float
    turns: float
    steps: int
    cap_m: float


CURLS = {
    "curls": Curl(0.0092, 0.0068, 0.0058, 0.0030, 0.0085, 2.2, 15, 0.0035),
    "coils": Curl(0.0068, 0.0056, 0.0034, 0.0022, 0.0046, 1.5, 9, 0.0026),
}
"""Styles by the names of their files."""
BUZZ_CAP_M = 0.0011
"""Hair cut to a few millimetres is a shell of stubs this far off the skin."""


def ribbons(
    paths: np.ndarray,
    across: np.ndarray,
    index: np.ndarray,
    weights: np.ndarray,
    skin: np.ndarray,
    uv: np.ndarray,
    shade: np.ndarray,
) -> Cards:
    """Cards of n ribbons of k pairs of vertices, each of which hangs on one mixture of skin.

    Parameters
    ----------
    paths, across : (n, k, 3) arrays
        Middle lines, m, and from there to one edge.
    index, weights : (n, m) arrays
        Of the skin that the roots stand on.
    skin : (vertex, 3) array
    uv : (n, k, 2, 2) array
        Of both edges.
    shade : (n, k) array
    """
    n, k, _ = paths.shape
    points = np.stack([paths - across, paths + across], 2).reshape(-1, 3)
    first = np.arange(n * k * 2).reshape(n, k, 2)
    quads = np.stack([first[:, :-1, 0], first[:, :-1, 1], first[:, 1:, 1], first[:, 1:, 0]], -1)
    quads = quads.reshape(-1, 4)
    index, weights = np.repeat(index, 2 * k, 0), np.repeat(weights, 2 * k, 0)
    offset = points - np.einsum("vk,vkc->vc", weights, skin[index])
    dark = np.repeat(shade.reshape(-1), 2)
    return Cards(index, weights, offset, quads, uv.reshape(-1, 2), quads, dark, points)


def together(first: Cards, second: Cards) -> Cards:
    """Both, with one picture."""
    width = max(first.index.shape[1], second.index.shape[1])

    def wide(values: np.ndarray) -> np.ndarray:
        return np.pad(values, ((0, 0), (0, width - values.shape[1])))

    return Cards(
        np.vstack([wide(first.index), wide(second.index)]),
        np.vstack([wide(first.weights), wide(second.weights)]),
        np.vstack([first.offset, second.offset]),
        np.vstack([first.quads, second.quads + len(first.points)]),
        np.vstack([first.uv, second.uv]),
        np.vstack([first.uv_quads, second.uv_quads + len(first.uv)]),
        np.concatenate([first.shade, second.shade]),
        np.vstack([first.points, second.points]),
    )


def curl_picture() -> np.ndarray:
    """(CURL_PX, CURL_PX, 4): locks side by side, frayed at their edges and tips."""
    lines = hairs(CURL_PX)
    u = (np.arange(CURL_PX) + 0.5) / CURL_PX * LANES % 1
    v = 1 - (np.arange(CURL_PX) + 0.5) / CURL_PX
    side = np.clip((0.5 - np.abs(u - 0.5)) / 0.22, 0, 1)
    tip = np.clip((1 - v) / 0.16, 0, 1)
    kept = np.minimum(side[None], tip[:, None]) * 2.4 - 0.75 + 0.45 * lines
    alpha = np.clip(kept * 2.2, 0, 1)
    light = 0.10 * noise(5, CURL_PX, (30.0, 3.0))
    tone = (0.66 + 0.15 * lines + light).clip(0.30, 1.0)
    return np.dstack([tone, tone, tone, alpha])


HAIRLINE_MM = 53.0
"""Height over the eyes where hair begins on the forehead."""
TEMPLE_MM = ((-20, -84), (0, -80), (15, -74), (30, -68), (44, -60), (53, -46))
"""Heights over the eyes, and how far behind the tip of the nose hair begins there."""
SIDEBURN_MM, OVER_EAR_MM, NAPE_MM = -12.0, 14.0, -50.0
"""Lowest hair before, over and behind the ear."""
EAR_MM = (-92.0, -137.0)
"""How far behind the tip of the nose an ear begins and ends."""
SOFT_MM = 5.0


def grows(millimetres: np.ndarray) -> np.ndarray:
    """(place,) 0 where no hair grows to 1 where it is thick, by `Canvas.millimetres`."""
    x, y, z = millimetres.T
    # Nobody's hairline is a line.
    y = y + 1.6 * np.sin(0.33 * x + 1) + 1.1 * np.sin(0.77 * x + 2) + 0.8 * np.sin(0.51 * z)
    z = z + 1.4 * np.sin(0.31 * y) + 1.0 * np.sin(0.73 * y + 1)

    def above(values: np.ndarray, limit: float | np.ndarray) -> np.ndarray:
        return np.clip((values - limit) / SOFT_MM + 0.5, 0, 1)

    start = np.interp(y, *np.array(TEMPLE_MM).T)
    before = above(z, EAR_MM[0]) * above(y, SIDEBURN_MM)
    behind = above(-z, -EAR_MM[1]) * above(y, NAPE_MM)
    side = above(-z, -start) * np.maximum.reduce([before, above(y, OVER_EAR_MM), behind])
    return np.maximum(above(y, HAIRLINE_MM), side)


def curls(fitting: Fitting, millimetres: np.ndarray, curl: Curl) -> Cards:
    """Curls all over the scalp, on a dark shell; `millimetres` (skin vertex, 3) as in `Canvas`."""
    rng = np.random.default_rng(8)
    quads = fitting.face.anatomy.skin_quads
    dense = Skin(fitting.skin, quads)
    moved = millimetres / 1000 - fitting.skin
    thick = grows(1000 * (dense.points + moved[0]))
    roots = _apart(dense.points, thick, rng, curl)
    place, share = dense.points[roots], thick[roots]
    normal = dense.normals[roots]
    count = len(roots)
    fall = np.stack([0.15 * rng.normal(size=count), np.full(count, -0.35), np.full(count, -0.1)], 1)
    axis = unit(normal + fall + 0.38 * rng.normal(size=(count, 3)))
    side = unit(np.cross(axis, rng.normal(size=(count, 3))))
    other = np.cross(axis, side)
    radius = curl.edge_radius_m + (curl.radius_m - curl.edge_radius_m) * share
    radius *= rng.uniform(0.75, 1.25, count)
    turns = curl.turns * rng.uniform(0.7, 1.2, count) * (0.55 + 0.45 * share)
    t = np.linspace(0, 1, curl.steps)
    angle = 2 * np.pi * turns[:, None] * t + rng.uniform(0, 2 * np.pi, (count, 1))
    hand = rng.choice([-1.0, 1.0], (count, 1))
    wide = radius[:, None] * np.clip(t / 0.12, 0.1, 1) * (1 - 0.35 * t)
    rise = curl.rise_m * turns[:, None] * (radius / curl.radius_m)[:, None] * t
    paths = (
        place[:, None]
        + axis[:, None] * rise[..., None]
        + side[:, None] * (wide * np.cos(angle))[..., None]
        + other[:, None] * (wide * np.sin(angle) * hand)[..., None]
    )
    half = BAND / 2 * radius[:, None] * np.clip(t / 0.1, 0.3, 1) * np.clip((1 - t) / 0.3, 0.15, 1)
    across = axis[:, None] * half[..., None] * np.ones((1, curl.steps, 1))
    lane = rng.integers(0, LANES, count)
    edges = (lane[:, None] + np.array([0.06, 0.94])) / LANES
    uv = np.stack(
        [
            np.broadcast_to(edges[:, None], (count, curl.steps, 2)),
            np.broadcast_to((0.04 + 0.92 * t)[None, :, None], (count, curl.steps, 2)),
        ],
        -1,
    )
    deep = np.clip(rise / (curl.rise_m * 1.4), 0, 1)
    shade = (0.60 + 0.40 * deep) * rng.uniform(0.75, 1.0, (count, 1))
    index, weights = fitting.nearest(place)
    return together(
        _cap(fitting, moved[0], curl.cap_m),
        ribbons(paths, across, index, weights, fitting.skin, uv, shade),
    )


def buzz(fitting: Fitting, millimetres: np.ndarray) -> Cards:
    """The stubs of hair cut close: a shell; `buzz_picture` has places to show through."""
    cap = _cap(fitting, (millimetres / 1000 - fitting.skin)[0], BUZZ_CAP_M)
    # Round the crown, the distance from it kept: nothing is drawn out.
    x, y, z = (cap.points - fitting.skin[fitting.skin[:, 1] > 0].mean(0)).T
    down, round_ = np.arctan2(np.hypot(x, z), y), np.arctan2(x, z)
    uv = 0.5 + 0.48 * (down / np.pi)[:, None] * np.stack([np.sin(round_), np.cos(round_)], 1)
    return replace(cap, uv=uv, shade=np.ones(len(cap.points)))


def buzz_picture() -> np.ndarray:
    """(CURL_PX, CURL_PX, 4): stubs, thick but for gaps that skin shows through."""
    alpha = np.clip(0.80 + 0.20 * noise(17, CURL_PX, 0.6), 0, 1)
    tone = (0.56 + 0.07 * noise(19, CURL_PX, 0.6)).clip(0.30, 1.0)
    return np.dstack([tone, tone, tone, alpha])


BUN_M, BUN_AT_M = (0.036, 0.036, 0.029), (0.0, 0.002, -0.004)
"""Half its width, height and depth, and where its middle is, from the tie of a ponytail."""
BUN_RINGS, BUN_SIDES, BUN_WINDS, BUN_RIDGE = 26, 44, 3.0, 0.075
BUN_LOCK = ((0.472, 0.17), (0.503, 0.42))
"""A solid lock in the picture of the ponytail: two corners of texture coordinates."""
TAIL_BEHIND_M = 0.0
"""What of a ponytail lies wholly behind this is its tail."""


def bun(pony: Cards, fitting: Fitting) -> Cards:
    """A ponytail's hair wound to a knot where its tail begins."""
    parts = _parts(pony)
    furthest = np.array([pony.points[parts == k, 2].max() for k in range(parts.max() + 1)])
    tail = furthest[parts] < TAIL_BEHIND_M
    tie = pony.points[tail & (pony.points[:, 1] > np.quantile(pony.points[tail, 1], 0.97))].mean(0)
    kept = _without(pony, tail)
    polar, around = np.meshgrid(
        np.linspace(0.02, np.pi - 0.02, BUN_RINGS),
        np.linspace(0, 2 * np.pi, BUN_SIDES),
        indexing="ij",
    )
    ridge = np.cos(2 * np.pi * BUN_WINDS * polar / np.pi + around)
    round_ = np.stack(
        [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), -np.cos(polar)], -1
    )
    points = (tie + BUN_AT_M + round_ * BUN_M * (1 + BUN_RIDGE * ridge)[..., None]).reshape(-1, 3)
    first = np.arange(BUN_RINGS * BUN_SIDES).reshape(BUN_RINGS, BUN_SIDES)
    quads = np.stack([first[:-1, :-1], first[1:, :-1], first[1:, 1:], first[:-1, 1:]], -1)
    quads = quads.reshape(-1, 4)
    # Hair runs round the knot: along a lock of the picture with the angle, across it in a winding.
    place = np.stack([0.5 - 0.5 * ridge, 0.5 - 0.5 * np.cos(around)], -1).reshape(-1, 2)
    low, high = np.array(BUN_LOCK)
    uv = low + place * (high - low)
    shade = (0.70 + 0.30 * (0.5 + 0.5 * ridge)).reshape(-1)
    index, weights = (np.repeat(each, len(points), 0) for each in fitting.nearest(tie[None]))
    offset = points - np.einsum("vk,vkc->vc", weights, fitting.skin[index])
    knot = Cards(index, weights, offset, quads, uv, quads, shade, points)
    return together(kept, knot)


def _parts(cards: Cards) -> np.ndarray:
    """(vertex,) which connected part each belongs to."""
    pairs = np.stack([cards.quads, np.roll(cards.quads, -1, 1)], -1).reshape(-1, 2)
    count = len(cards.points)
    links = sp.coo_matrix((np.ones(len(pairs)), tuple(pairs.T)), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1])


def _without(cards: Cards, left_out: np.ndarray) -> Cards:
    """Cards without some vertices and all faces at them."""
    faces = ~left_out[cards.quads].any(1)
    used, quads = np.unique(cards.quads[faces], return_inverse=True)
    texcoords, uv_quads = np.unique(cards.uv_quads[faces], return_inverse=True)
    return Cards(
        cards.index[used],
        cards.weights[used],
        cards.offset[used],
        quads.reshape(-1, 4),
        cards.uv[texcoords],
        uv_quads.reshape(-1, 4),
        cards.shade[used],
        cards.points[used],
    )


def _cap(fitting: Fitting, moved: np.ndarray, off_m: float) -> Cards:
    """The scalp once more, a little further out; its edge dives under the skin."""
    points, quads, _ = subdivided(fitting.skin, fitting.face.anatomy.skin_quads)
    thick = grows(1000 * (points + moved))
    normals = vertex_normals(points, triangles(quads))
    quads = quads[(thick[quads] > 0).any(1)]
    used, own = np.unique(quads, return_inverse=True)
    own = own.reshape(-1, 4)
    points = points[used] + normals[used] * (off_m * (2.4 * thick[used] ** 2 - 1.4))[:, None]
    index, weights = fitting.nearest(points)
    # Strands run down, within one lock of the picture: shading needs their direction.
    x, y, z = (points - points.mean(0)).T
    turn = np.cos(np.arctan2(x, z))
    uv = np.stack([(0.5 + 0.2 * turn) / LANES, 0.45 + 0.25 * y / np.abs(y).max()], 1)
    offset = points - np.einsum("vk,vkc->vc", weights, fitting.skin[index])
    dark = np.full(len(used), CAP_SHADE)
    return Cards(index, weights, offset, own, uv, own, dark, points)


def _apart(
    points: np.ndarray, thick: np.ndarray, rng: np.random.Generator, curl: Curl
) -> np.ndarray:
    """Which points are roots: as many as fit at their distance from each other."""
    tree = KDTree(points)
    free = thick > 0.4
    chosen = []
    for k in rng.permutation(np.flatnonzero(free)):
        if free[k]:
            chosen.append(k)
            apart = curl.edge_apart_m + (curl.apart_m - curl.edge_apart_m) * thick[k]
            free[tree.query_ball_point(points[k], apart)] = False
    return np.array(chosen)
