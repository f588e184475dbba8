"""Ribbons with pairs of vertices only where they bend: straight hair needs few."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from recipes.looks.cards import Cards
from recipes.looks.scalp import Scalp

STRAYS_M, FURTHEST_M = 0.0013, 0.060
"""How far the edges of a ribbon may go from where they were, and how long its quads may be: light
is computed at their corners."""
BESIDE_FACE_MM, FINER = ((-112.0, 62.0), 0.25)
"""Before the first, behind the tip of the nose, and below the second, over the eyes, one sees
ribbons one by one, and every corner of them: they may stray but by this share of it."""
SHADE_DIFFERS = 0.1
"""How far its brightness may, of 1."""
WIDTHS_TO_M = 0.010
"""A difference of 1 in the picture's height counts as so much: locks are not to slip along it."""


def fewer_pairs(scalp: Scalp, cards: Cards) -> Cards:
    """The same cards, without pairs of their ribbons that lie where their neighbours lead."""
    ribbons = _ribbons(cards)
    drop = np.zeros(len(cards.points), bool)
    _, height, behind = scalp.places(cards.points).T
    beside = (behind > BESIDE_FACE_MM[0]) & (height < BESIDE_FACE_MM[1])
    measured = _measured(cards)
    finer = np.where(beside, FINER, 1.0)
    for pairs in ribbons:
        drop[pairs[~_needed(measured, finer, pairs)]] = True
    return _without(cards, ribbons, drop)


def _measured(cards: Cards) -> np.ndarray:
    """(vertex, k) what has to stay, in units of what it may differ by."""
    uv = np.zeros((len(cards.points), 2))
    uv[cards.quads] = cards.uv[cards.uv_quads]
    return np.column_stack(
        [cards.points / STRAYS_M, cards.shade / SHADE_DIFFERS, uv[:, 1] * WIDTHS_TO_M / STRAYS_M]
    )


def _ribbons(cards: Cards) -> list[np.ndarray]:
    """(n, 2) vertices of each chain of quads, from root to tip; meshes are none."""
    quads = cards.quads
    after = {(a, b): (d, c) for a, b, c, d in quads.tolist()}
    used = np.bincount(quads.ravel(), minlength=len(cards.points))
    led = set(after.values())
    chains = []
    for start in after:
        if start in led or max(used[list(start)]) > 1:
            continue
        chain = [start]
        while chain[-1] in after:
            chain.append(after[chain[-1]])
        inner = np.array(chain)
        if len(chain) > 2 and (used[inner[1:-1]] == 2).all() and (used[inner[-1]] == 1).all():
            chains.append(inner)
    return chains


def _needed(measured: np.ndarray, finer: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """(n,) which pairs have to stay (Douglas and Peucker)."""
    ways = measured[pairs].reshape(len(pairs), -1)
    least = finer[pairs].min(1)
    middle = measured[pairs][:, :, :3].mean(1) * STRAYS_M
    gone = np.r_[0, np.cumsum(np.linalg.norm(np.diff(middle, axis=0), axis=1))]
    needed = np.zeros(len(pairs), bool)
    needed[[0, -1]] = True
    spans = [(0, len(pairs) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        share = ((gone[first + 1 : last] - gone[first]) / (gone[last] - gone[first]))[:, None]
        straight = ways[first] + share * (ways[last] - ways[first])
        off = np.abs(ways[first + 1 : last] - straight).max(1) / least[first + 1 : last]
        at = first + 1 + int(off.argmax())
        if off.max() <= 1 and gone[last] - gone[first] <= FURTHEST_M:
            continue
        if off.max() <= 1:
            at = first + 1 + int(np.abs(share - 0.5).argmin())
        needed[at] = True
        spans += [(first, at), (at, last)]
    return needed


def _without(cards: Cards, ribbons: list[np.ndarray], drop: np.ndarray) -> Cards:
    """Cards whose ribbons leave out the vertices to be dropped."""
    place = np.zeros(len(cards.points), int)
    place[cards.quads] = cards.uv_quads
    thinned = np.zeros(len(cards.points), bool)
    quads = []
    for pairs in ribbons:
        thinned[pairs] = True
        left = pairs[~drop[pairs[:, 0]]]
        quads.append(np.hstack([left[:-1], left[1:, ::-1]]))
    others = ~thinned[cards.quads].all(1)
    whole = np.vstack([cards.quads[others], *quads])
    uv_quads = np.vstack([cards.uv_quads[others], place[whole[others.sum() :]]])
    used, whole = np.unique(whole, return_inverse=True)
    places, uv_quads = np.unique(uv_quads, return_inverse=True)
    return replace(
        cards,
        quads=whole.reshape(-1, 4),
        uv=cards.uv[places],
        uv_quads=uv_quads.reshape(-1, 4),
        **{
            name: getattr(cards, name)[used]
            for name in ("index", "weights", "offset", "shade", "points")
        },
    )
