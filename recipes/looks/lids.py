"""Where lids are on the atlas: their skin, their edges, the crease of the upper one, its lashes."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial import KDTree

from recipes.looks.canvas import Canvas, blurred, noise

SIDES = ("Left", "Right")
LID_MOVES_M = (0.0008, 0.0035)
"""Skin that a blink moves by less is no lid; by more, all lid."""
CREASE_MM = ((-0.12, 1.8), (0.0, 2.6), (0.25, 3.7), (0.55, 4.2), (0.85, 4.0), (1.2, 2.4))
"""Of an upper lid: share of the way from the nose outwards, height over the lid's edge."""
LID_MM = 0.0035
"""A millimetre above a lid, as a part of the atlas."""
CREASE_WIDTH_MM, FOLD_WIDTH_MM, LASH_LINE_MM = 0.9, 3.0, 0.5
"""Of the crease itself, of the soft shade round it, and of the roots of the lashes."""
VEIN_PITCH, VEIN_WIDTH = 1 / 70, 0.09
"""Between the thin veins of a lid, as a part of the atlas; their width, in deviations of noise."""
RIM_MM = (15.3, 16.0)
"""The edges of lids are that far from the eye's centre."""


def lids(canvas: Canvas, size: int) -> np.ndarray:
    """What a blink unfolds."""
    head = canvas.head
    blinks = [head.expression_basis[head.expression_index(f"eyeBlink{side}")] for side in SIDES]
    moved = np.linalg.norm(sum(blinks), axis=1)
    share = np.clip((moved - LID_MOVES_M[0]) / np.ptp(LID_MOVES_M), 0, 1)
    return blurred(canvas.spread(share, size), size / 250).clip(0, 1)


def rims(canvas: Canvas, size: int) -> np.ndarray:
    """Where lids end and lie on the eyes."""
    head, at = canvas.head, canvas.millimetres
    away = np.full(len(at), np.inf)
    for side in SIDES:
        around = head.regions[f"eye_area_{side.lower()}"]
        ball = at[head.regions[f"eye_{side.lower()}"]]
        centre = (ball[0] + ball[-1]) / 2
        away[around] = np.linalg.norm(at[around] - centre, axis=1)
    share = ((RIM_MM[1] - away) / np.ptp(RIM_MM)).clip(0, 1)
    return canvas.spread(share, size).clip(0, 1)


def lines(canvas: Canvas, size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(size, size) 0..1 each: the creases of upper lids, the soft folds that they lie in, the
    roots of their lashes."""
    creases, folds, lashes = np.zeros((3, size, size))
    at = canvas.millimetres
    share, height = np.array(CREASE_MM).T
    for side in SIDES:
        edge = canvas.head.regions[f"lid_upper_{side.lower()}"]
        edge = edge[np.argsort(np.abs(at[edge, 0]))]
        places = canvas.places[np.argmax(canvas.vertices[None] == edge[:, None], axis=1)]
        lashes += _traced(places, size, LASH_LINE_MM)
        way = (places[:, 0] - places[0, 0]) / (places[-1, 0] - places[0, 0])
        x = places[0, 0] + share * (places[-1, 0] - places[0, 0])
        y = np.interp(share, way, places[:, 1]) - height * LID_MM
        creases += _traced(np.stack([x, y], 1), size, CREASE_WIDTH_MM)
        folds += _traced(np.stack([x, y], 1), size, FOLD_WIDTH_MM)
    return creases.clip(0, 1), folds.clip(0, 1), lashes.clip(0, 1)


def veins(size: int) -> np.ndarray:
    """(size, size) 0..1: thin winding lines, where noise passes through zero."""
    winding, strong = noise(41, size, VEIN_PITCH * size), noise(42, size, 1.5 * VEIN_PITCH * size)
    return np.exp(-((winding / VEIN_WIDTH) ** 2)) * (0.5 + 0.5 * strong).clip(0, 1)


def _traced(places: np.ndarray, size: int, width_mm: float) -> np.ndarray:
    """(size, size) 0..1: a soft line through places of the atlas, fainter towards its ends."""
    way = np.r_[0, np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))]
    finer = np.linspace(0, way[-1], 300)
    path = PchipInterpolator(way, places)(finer)
    at = np.stack(np.meshgrid(*[(np.arange(size) + 0.5) / size] * 2), -1)
    away, nearest = map(np.asarray, KDTree(path).query(at))
    share = finer[nearest] / way[-1]
    ends = (np.minimum(share, 1 - share) / 0.2).clip(0, 1)
    return np.exp(-((away / (width_mm * LID_MM)) ** 2)) * ends * (2 - ends)
