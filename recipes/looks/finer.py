"""Cards with four faces for each one, so that outlines are round."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from recipes.looks.cards import Cards
from recipes.looks.surface import split, subdivided, subdivided_flat

MIXED = 4
"""Skin vertices that a vertex hangs on, at most."""
LARGEST_BULGE = 0.25
"""Of an edge's length: how far its middle may be moved out. Normals at seams say nothing."""


def finer(cards: Cards, skin: np.ndarray) -> Cards:
    """The same cards with a vertex more on each edge and in each face; old ones stay."""
    points, quads = _round(cards)
    index, weights = _mixtures(cards)
    uv, uv_quads = subdivided_flat(cards.uv, cards.uv_quads)
    return replace(
        cards,
        index=index,
        weights=weights,
        offset=points - np.einsum("vk,vkc->vc", weights, skin[index]),
        quads=quads,
        uv=uv,
        uv_quads=uv_quads,
        shade=subdivided_flat(cards.shade[:, None], cards.quads)[0][:, 0],
        points=points,
    )


def _round(cards: Cards) -> tuple[np.ndarray, np.ndarray]:
    """(vertex, 3) places and (face, 4) quads."""
    made = split(cards.quads, len(cards.points))
    flat, _ = subdivided_flat(cards.points, cards.quads)
    points, quads, _ = subdivided(cards.points, cards.quads)
    edge = np.linalg.norm(np.diff(cards.points[made.ends], axis=1)[:, 0], axis=1)
    reach = LARGEST_BULGE * np.r_[np.zeros(len(cards.points)), edge, edge[made.sides].mean(1)]
    far = np.linalg.norm(points - flat, axis=1)
    return flat + (points - flat) * np.minimum(1, reach / np.maximum(far, 1e-9))[:, None], quads


def _mixtures(cards: Cards) -> tuple[np.ndarray, np.ndarray]:
    """(vertex, MIXED) skin vertices and their shares: the largest of the parents' together."""
    made = split(cards.quads, len(cards.points))
    parents = [[k] for k in range(len(cards.points))] + made.ends.tolist() + cards.quads.tolist()
    index = np.zeros((len(parents), MIXED), int)
    weights = np.zeros((len(parents), MIXED))
    for row, corners in enumerate(parents):
        shares: dict[int, float] = {}
        for corner in corners:
            for place, share in zip(cards.index[corner], cards.weights[corner], strict=True):
                shares[int(place)] = shares.get(int(place), 0.0) + float(share)
        largest = sorted(shares.items(), key=lambda pair: -pair[1])[:MIXED]
        index[row, : len(largest)] = [place for place, _ in largest]
        weights[row, : len(largest)] = [share for _, share in largest]
    return index, weights / weights.sum(1, keepdims=True)
