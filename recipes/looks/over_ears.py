"""Long hair lies over the ears: it is combed as if there were none, and led round them after."""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np
import scipy.ndimage as ndimage
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from recipes.head.face import NeutralFace
from recipes.head.topology import adjacency
from recipes.looks.cards import Cards
from recipes.looks.scalp import Scalp
from recipes.looks.surface import Skin, subdivided, subdivided_flat

CELL_M, WIDER_M, SOFT_M = 0.003, 0.009, 0.008
"""Cells of the map of how far out a head reaches, how far round an ear its own reach goes, how
soft the map is."""
CLEAR_M, LAYERED = 0.0145, 0.75
"""Hair keeps this far off the average ear, as others stand out further; and how far what lies
too deep comes up, so that locks that lay on each other still do."""
REACH_M = np.array([[0.12, 0.05], [0.09, 0.05]])
"""Beyond the ears that the map goes: down and to the back, up and to the front."""
COMES_IN = 0.30
"""Below the ears hair comes in no faster than so much of its way down: it hangs from what holds it.
"""
SPANNED_M = 0.004
"""Hair that would have to come out so far to hang straight past a hollow does so."""


def without_ears(scalp: Scalp) -> Scalp:
    """The same scalp, but hair meets a smooth skull where the ears are."""
    face, points = scalp.fitting.face, scalp.fitting.skin.copy()
    quads = face.anatomy.skin_quads
    links = adjacency(quads, len(points))
    laplace = (sp.diags(np.asarray(links.sum(1)).ravel()) - links).tocsr()
    ear = face.ears.auricle > 0.02
    points[ear] = spsolve(laplace[ear][:, ear].tocsc(), -(laplace[ear][:, ~ear] @ points[~ear]))
    bare = copy(scalp)
    bare.skin = Skin(points, quads)
    return bare


def over_ears(face: NeutralFace, cards: Cards) -> Cards:
    """Cards of hair that hangs outside the ears."""
    quads = face.anatomy.skin_quads
    ear, _ = subdivided_flat(face.ears.auricle[:, None], quads)
    skin, _, _ = subdivided(face.skin, quads)
    ear = ear[:, 0] > 0.5
    low = skin[ear].min(0)[1:] - REACH_M[0]
    shape = np.ceil((skin[ear].max(0)[1:] + REACH_M[1] - low) / CELL_M).astype(int)
    out = _map(skin, low, shape)
    where = _map(skin[ear], low, shape) > 0
    where = ndimage.maximum_filter(where * 1.0, round(2 * WIDER_M / CELL_M) + 1)
    out = ndimage.maximum_filter(out, round(2 * WIDER_M / CELL_M) + 1)
    soft = SOFT_M / CELL_M
    share = ndimage.gaussian_filter(where, soft)
    out = ndimage.gaussian_filter(out, soft) + CLEAR_M * share
    straight = np.stack([_spanned(column) for column in out.T], 1)
    # Only past the ears: over the face hair may lie in the hollow of the temple.
    share = np.maximum(share, share.max(0) * np.clip((straight - out) / SPANNED_M, 0, 1))
    share, straight = (ndimage.gaussian_filter(each, soft) for each in (share, straight))
    at = ((cards.points[:, 1:] - low) / CELL_M - 0.5).T
    wanted = ndimage.map_coordinates(straight, at, order=1, mode="constant")
    beside = ndimage.map_coordinates(share, at, order=1, mode="constant")
    aside = np.abs(cards.points[:, 0])
    more = LAYERED * beside * np.maximum(wanted - aside, 0) * (aside > 0.5 * wanted)
    moved = np.zeros_like(cards.points)
    moved[:, 0] = np.sign(cards.points[:, 0]) * more
    return replace(cards, points=cards.points + moved, offset=cards.offset + moved)


def _spanned(out: np.ndarray) -> np.ndarray:
    """How far out hair lies that hangs straight past hollows; from below to above, m."""
    hangs = out.copy()
    for k in reversed(range(len(out) - 1)):
        hangs[k] = max(hangs[k], hangs[k + 1] - COMES_IN * CELL_M)
    held: list[int] = []
    for k in range(len(hangs)):
        while len(held) > 1 and _hollow(hangs, held[-2], held[-1], k):
            held.pop()
        held.append(k)
    return np.interp(np.arange(len(out)), held, hangs[held])


def _hollow(out: np.ndarray, below: int, middle: int, above: int) -> bool:
    """Whether the middle lies further in than the way from below to above."""
    share = (middle - below) / (above - below)
    return bool(out[middle] <= out[below] + share * (out[above] - out[below]))


def _map(points: np.ndarray, low: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """How far from the middle points reach, at each height and depth, m; 0 where none is."""
    cell = np.floor((points[:, 1:] - low) / CELL_M).astype(int)
    inside = ((cell >= 0) & (cell < shape)).all(1)
    reach = np.zeros(shape)
    np.maximum.at(reach, tuple(cell[inside].T), np.abs(points[inside, 0]))
    return reach
