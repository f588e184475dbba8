"""Curls as ribbons that grow on the scalp: MakeHuman's hair has none."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from elocute.head.normals import vertex_normals
from recipes.looks.canvas import noise
from recipes.looks.cards import Cards, Fitting
from recipes.looks.strands import hairs
from recipes.looks.surface import Skin, subdivided, triangles, unit

CURL_PX, LANES = 512, 8
"""Size of the picture of curls, and how many locks stand in it side by side."""
ROOT_APART_M, EDGE_APART_M = 0.0092, 0.0068
"""Distance of the roots of curls: on top, and at the hairline, where they are smaller."""
CURL_M, EDGE_CURL_M = 0.0058, 0.0030
"""Radius of curls, likewise."""
RISE_M = 0.0085
"""How far a turn of a curl takes it on."""
TURNS, STEPS = 2.2, 15
BAND = 0.95
"""Width of a curl's ribbon by the radius."""
CAP_M, CAP_SHADE = 0.0035, 0.42
"""Under the curls lies a shell this far off the skin, dark."""


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


def curls(fitting: Fitting, millimetres: np.ndarray) -> Cards:
    """Curls all over the scalp, on a dark shell; `millimetres` (skin vertex, 3) as in `Canvas`."""
    rng = np.random.default_rng(8)
    quads = fitting.face.anatomy.skin_quads
    dense = Skin(fitting.skin, quads)
    moved = millimetres / 1000 - fitting.skin
    thick = grows(1000 * (dense.points + moved[0]))
    roots = _apart(dense.points, thick, rng)
    place, share = dense.points[roots], thick[roots]
    normal = dense.normals[roots]
    count = len(roots)
    fall = np.stack([0.15 * rng.normal(size=count), np.full(count, -0.35), np.full(count, -0.1)], 1)
    axis = unit(normal + fall + 0.38 * rng.normal(size=(count, 3)))
    side = unit(np.cross(axis, rng.normal(size=(count, 3))))
    other = np.cross(axis, side)
    radius = EDGE_CURL_M + (CURL_M - EDGE_CURL_M) * share
    radius *= rng.uniform(0.75, 1.25, count)
    turns = TURNS * rng.uniform(0.7, 1.2, count) * (0.55 + 0.45 * share)
    t = np.linspace(0, 1, STEPS)
    angle = 2 * np.pi * turns[:, None] * t + rng.uniform(0, 2 * np.pi, (count, 1))
    hand = rng.choice([-1.0, 1.0], (count, 1))
    wide = radius[:, None] * np.clip(t / 0.12, 0.1, 1) * (1 - 0.35 * t)
    rise = RISE_M * turns[:, None] * (radius / CURL_M)[:, None] * t
    paths = (
        place[:, None]
        + axis[:, None] * rise[..., None]
        + side[:, None] * (wide * np.cos(angle))[..., None]
        + other[:, None] * (wide * np.sin(angle) * hand)[..., None]
    )
    half = BAND / 2 * radius[:, None] * np.clip(t / 0.1, 0.3, 1) * np.clip((1 - t) / 0.3, 0.15, 1)
    across = axis[:, None] * half[..., None] * np.ones((1, STEPS, 1))
    lane = rng.integers(0, LANES, count)
    edges = (lane[:, None] + np.array([0.06, 0.94])) / LANES
    uv = np.stack(
        [
            np.broadcast_to(edges[:, None], (count, STEPS, 2)),
            np.broadcast_to((0.04 + 0.92 * t)[None, :, None], (count, STEPS, 2)),
        ],
        -1,
    )
    deep = np.clip(rise / (RISE_M * 1.4), 0, 1)
    shade = (0.60 + 0.40 * deep) * rng.uniform(0.75, 1.0, (count, 1))
    index, weights = fitting.nearest(place)
    return together(
        _cap(fitting, moved[0]), ribbons(paths, across, index, weights, fitting.skin, uv, shade)
    )


def _cap(fitting: Fitting, moved: np.ndarray) -> Cards:
    """The scalp once more, a little further out; its edge dives under the skin."""
    points, quads, _ = subdivided(fitting.skin, fitting.face.anatomy.skin_quads)
    thick = grows(1000 * (points + moved))
    normals = vertex_normals(points, triangles(quads))
    quads = quads[(thick[quads] > 0).any(1)]
    used, own = np.unique(quads, return_inverse=True)
    own = own.reshape(-1, 4)
    points = points[used] + normals[used] * (CAP_M * (2.4 * thick[used] ** 2 - 1.4))[:, None]
    index, weights = fitting.nearest(points)
    # Strands run down, within one lock of the picture: shading needs their direction.
    x, y, z = (points - points.mean(0)).T
    turn = np.cos(np.arctan2(x, z))
    uv = np.stack([(0.5 + 0.2 * turn) / LANES, 0.45 + 0.25 * y / np.abs(y).max()], 1)
    offset = points - np.einsum("vk,vkc->vc", weights, fitting.skin[index])
    dark = np.full(len(used), CAP_SHADE)
    return Cards(index, weights, offset, own, uv, own, dark, points)


def _apart(points: np.ndarray, thick: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Which points are roots: as many as fit at their distance from each other."""
    tree = KDTree(points)
    free = thick > 0.4
    chosen = []
    for k in rng.permutation(np.flatnonzero(free)):
        if free[k]:
            chosen.append(k)
            apart = EDGE_APART_M + (ROOT_APART_M - EDGE_APART_M) * thick[k]
            free[tree.query_ball_point(points[k], apart)] = False
    return np.array(chosen)
