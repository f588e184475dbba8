"""Hair that hangs beside a face lies on its cheeks, or one sees a mask between two curtains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import KDTree

from recipes.looks.cards import NEAREST, Cards
from recipes.looks.scalp import Scalp, ramp

INWARD_MM, AHEAD_MM = 13.0, 18.0
"""How far the foremost locks come towards the middle, and forward with all behind them."""
INWARD_FROM_MM, AHEAD_FROM_MM = (-88.0, -58.0), (-165.0, -55.0)
"""Distances behind the tip of the nose between which they come to it: hair is stretched over the
ear, not torn open."""
BELOW_MM, ABOVE_MM, ASIDE_MM = (34.0, -14.0), (-190.0, -110.0), (35.0, 50.0)
"""Heights over the eyes, and distances from the middle, between which they do."""
OFF_MM, WITHIN_MM = 5.0, 30.0
"""They stay so far off the skin; what lies deeper in it than the second is on its other side."""
TEMPLE_OFF_MM, TEMPLE_MM, BEFORE_MM = 2.0, (64.0, 54.0), (-110.0, -90.0)
"""What lies on the corners of the forehead keeps so far off them, below those heights over the eyes
and before those distances behind the tip of the nose: else it comes out of the skin at the temple,
as if it were cut off there."""
SMOOTHED, TIMES = 0.5, 12
"""How far each pair of a ribbon comes to the middle of its neighbours at a time: what is led round
cheeks, ears and shoulders one after the other would else be bent like wire."""
STILL_M = 0.001
"""Locks follow the width of the cheeks, but only skin that no shape moves further."""


def beside_face(scalp: Scalp, cards: Cards, shapes: np.ndarray) -> Cards:
    """The same cards, led over the cheeks; `shapes` (shape, vertex, 3) m move the skin."""
    places = scalp.places(cards.points)
    aside, height, depth = np.abs(places[:, 0]), places[:, 1], places[:, 2]
    share = ramp(height, *BELOW_MM) * ramp(height, *ABOVE_MM) * ramp(aside, *ASIDE_MM)
    share = share * ramp(depth, *AHEAD_FROM_MM)
    foremost = share * ramp(depth, *INWARD_FROM_MM)
    moved = np.zeros_like(places)
    moved[:, 0] = -INWARD_MM * foremost * np.sign(places[:, 0])
    moved[:, 2] = AHEAD_MM * share
    points = cards.points + moved / 1000
    along = _along(cards)
    off_mm = np.where(share > 0.02, OFF_MM, 0)
    off_mm = np.maximum(off_mm, TEMPLE_OFF_MM * ramp(height, *TEMPLE_MM) * ramp(depth, *BEFORE_MM))
    off_mm[_begins(cards)] = 0
    for _ in range(TIMES):
        points = points + SMOOTHED * share[:, None] * (along @ points - points)
        foot, normal = scalp.skin.nearest(points)
        above = 1000 * ((points - foot) * normal).sum(1)
        within = (off_mm > 0) & (above < off_mm) & (above > -WITHIN_MM)
        points = points + normal * np.where(within, off_mm - above, 0)[:, None] / 1000
    return _hung_on(scalp, replace(cards, points=points), np.sqrt(foremost), shapes)


def _begins(cards: Cards) -> np.ndarray:
    """(vertex,) where ribbons begin, in the skin."""
    begins = np.ones(len(cards.points), bool)
    begins[cards.quads[:, [3, 2]]] = False
    return begins


def _along(cards: Cards) -> sp.csr_matrix:
    """(vertex, vertex) the mean of what is before and behind each in its ribbon; ends stay."""
    quads, count = cards.quads, len(cards.points)
    before, behind = quads[:, :2].ravel(), quads[:, [3, 2]].ravel()
    links = sp.coo_matrix((np.ones(len(before)), (before, behind)), (count, count)).tocsr()
    links = links + links.T
    inner = np.asarray(links.sum(1)).ravel() == 2
    return sp.diags(inner / 2) @ links + sp.diags(1.0 - inner)


def _hung_on(scalp: Scalp, cards: Cards, share: np.ndarray, shapes: np.ndarray) -> Cards:
    """That share of each vertex hangs on still skin near it, the rest where it hung."""
    skin = scalp.fitting.skin
    still = np.flatnonzero((np.linalg.norm(shapes[:, : len(skin)], axis=2) < STILL_M).all(0))
    away, nearest = KDTree(skin[still]).query(cards.points, NEAREST)
    near = 1 / np.maximum(away, 1e-5)
    near = near / near.sum(1, keepdims=True)
    index = np.hstack([cards.index, still[nearest]])
    weights = np.hstack([cards.weights * (1 - share)[:, None], near * share[:, None]])
    offset = cards.points - np.einsum("vk,vkc->vc", weights, skin[index])
    return replace(cards, index=index, weights=weights, offset=offset)
