"""The collar of a woven shirt: a leaf of two layers folded over the band, with two points."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy.ndimage as ndimage

from recipes.looks.surface import Skin, unit

POINT_COLUMN = 4
"""Columns from the middle of the throat to the fold above a point."""
THROAT_M, POINT_M, SIDE_M, FADES = 0.004, 0.064, 0.040, 17
"""Length of the leaf at the throat, at its points, and from `FADES` columns on."""
LONGEST_M = POINT_M + 0.004
POINT_ASIDE_M = 0.006
"""How much further from the middle the points are than the way down from their fold leads."""
THICK_M, OFF_M, BULGE_M = 0.0026, (0.0048, 0.0085, 0.0112), 0.0040
"""Between the layers; the leaf off the skin at its fold, at its edge and at its points; how far
it is rolled."""
OUTER = (0.10, 0.22, 0.36, 0.52, 0.68, 0.82, 0.92, 0.975)
INNER = (0.985, 0.93, 0.70, 0.40, 0.16)
"""Rings of the two layers, as shares of the way from the fold to the edge."""
EDGE_RING = len(OUTER)
BUTTONS_M, BUTTON_M, BUTTON_SIDES = (0.026, 0.092), 0.0056, 14
"""How far below the band buttons sit, their radius, and the corners of their outline."""
BUTTON_SECTION = ((0.22, 0.0010), (0.62, 0.0011), (0.74, 0.0018), (0.90, 0.0018), (1.0, 0.0008))
BUTTON_SECTION += ((0.99, -0.0008),)
"""Shares of the radius from the middle outwards, and heights over the cloth, m."""
BUTTON_LIFT_M = 0.0008
BUTTON_UV = (0.99, 0.5)
"""In the margin of the picture, which is bright."""


def along(way: np.ndarray, place: np.ndarray) -> np.ndarray:
    """(column, 3) points of ways (step, column, 3) at fractional steps (column,)."""
    low = np.minimum(place.astype(int), len(way) - 2)
    column, share = np.arange(way.shape[1]), (place - low)[:, None]
    return (1 - share) * way[low, column] + share * way[low + 1, column]


def leaf(skin: Skin, way: np.ndarray, step_m: float, fold: np.ndarray) -> list[np.ndarray]:
    """The rings of a leaf, each (column, 3): over its outer side to its edge and back below.

    Parameters
    ----------
    skin : Skin
        Of neck and body.
    way : (step, column, 3) ndarray
        From the band's upper edge down the body.
    step_m : float
        Between two steps.
    fold : (column, 3) ndarray
        The ring that the leaf hangs from.
    """
    away = _from_the_throat(fold)
    edge = _edge(skin, way, step_m, away)
    outer = {share: _layer(skin, fold, edge, share) for share in (*OUTER, *INNER, 1.0)}
    rim, normal = outer[1.0]
    over = unit(rim - outer[0.92][0])
    rings = [outer[share][0] for share in OUTER]
    rings.append(rim + 0.0007 * over - 0.5 * THICK_M * normal)
    rings += [outer[share][0] - THICK_M * outer[share][1] for share in INNER]
    return rings


def _from_the_throat(fold: np.ndarray) -> np.ndarray:
    """(column,) how many columns each is away from the middle of the throat, to either side."""
    count = len(fold)
    front = np.flatnonzero(fold[:, 2] > np.median(fold[:, 2]))
    middle = front[np.abs(fold[front, 0]).argmin()]
    turned = (np.arange(count) - middle) % count
    return np.minimum(turned, count - turned)


def _edge(skin: Skin, way: np.ndarray, step_m: float, away: np.ndarray) -> np.ndarray:
    """(column, 3): straight from the throat to a point, then round the neck."""
    fading = np.clip((away - POINT_COLUMN) / (FADES - POINT_COLUMN), 0, 1)
    length = POINT_M + (SIDE_M - POINT_M) * (2 * fading - fading**2)
    edge = along(way, length / step_m)
    edge[:, 0] += np.sign(edge[:, 0]) * POINT_ASIDE_M * (1 - fading) ** 2
    edge = skin.nearest(edge)[0]
    throat = way[round(THROAT_M / step_m), away.argmin()]
    for point in np.flatnonzero(away == POINT_COLUMN):
        side = (away < POINT_COLUMN) & (np.sign(way[0, :, 0]) == np.sign(way[0, point, 0]))
        side |= away == 0
        share = (away[side] / POINT_COLUMN)[:, None]
        edge[side] = throat + share * (edge[point] - throat)
    return edge


def _layer(
    skin: Skin, fold: np.ndarray, edge: np.ndarray, share: float
) -> tuple[np.ndarray, np.ndarray]:
    """(column, 3) the outer side at a share of the way to the edge, and which way is out."""
    straight = fold + share * (edge - fold)
    place, normal = skin.nearest(straight)
    normal = unit(ndimage.gaussian_filter1d(normal, 2.0, axis=0, mode="wrap"))
    off = ((straight - place) * normal).sum(1)
    reach = np.linalg.norm(edge - fold, axis=1)
    end = np.interp(reach, (SIDE_M, POINT_M), OFF_M[1:])
    least = OFF_M[0] + (end - OFF_M[0]) * share
    lift = ndimage.maximum_filter1d(np.maximum(least - off, 0), 3, mode="wrap")
    lift = ndimage.gaussian_filter1d(lift, 1.5, mode="wrap")
    lift += BULGE_M * np.sin(np.pi * share**0.7) * np.minimum(1, reach / SIDE_M)
    return straight + lift[:, None] * normal, normal


def buttons(cloth: Skin, rim: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points (n, 3) and quads of each button down the front, below the rim (column, 3)."""
    away = _from_the_throat(rim)
    start = rim[away.argmin()][None]
    turns = 2 * np.pi * np.arange(BUTTON_SIDES) / BUTTON_SIDES
    here, last = np.arange(BUTTON_SIDES), BUTTON_SIDES - 1
    beside = np.roll(here, -1)
    rings = [k * BUTTON_SIDES for k in range(len(BUTTON_SECTION))]
    faces = [np.stack([a + here, b + here, b + beside, a + beside], 1) for a, b in pairwise(rings)]
    faces.append(np.array([[k, k + 1, last - k - 1, last - k] for k in range(last // 2)]))
    made = []
    for below in BUTTONS_M:
        place, _ = cloth.walk(start, np.array([[0.0, -1.0, 0.0]]), below)
        middle, normal = place[0] * [0, 1, 1], unit(cloth.nearest(place)[1][0] * [0, 1, 1])
        up = np.cross(normal, [1.0, 0, 0])
        spoke = np.outer(np.cos(turns), [1.0, 0, 0]) + np.outer(np.sin(turns), up)
        points = [
            middle + share * BUTTON_M * spoke + (BUTTON_LIFT_M + high) * normal
            for share, high in BUTTON_SECTION
        ]
        made.append((np.vstack(points), np.vstack(faces)))
    return made
