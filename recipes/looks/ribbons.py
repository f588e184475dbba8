"""Cards that are ribbons: a middle line, a width, a lock of a picture."""

from __future__ import annotations

import numpy as np

from recipes.looks.cards import Cards


def ribbons(
    paths: np.ndarray,
    across: np.ndarray,
    index: np.ndarray,
    weights: np.ndarray,
    skin: np.ndarray,
    uv: np.ndarray,
    shade: np.ndarray,
) -> Cards:
    """Cards of n ribbons of k pairs of vertices.

    Parameters
    ----------
    paths, across : (n, k, 3) arrays
        Middle lines, m, and from there to one edge.
    index, weights : (n, m) or (n, k, m) arrays
        Mixtures of skin that whole ribbons or single pairs hang on.
    skin : (vertex, 3) array
        Vertices of the skin, m.
    uv : (n, k, 2, 2) array
        Of both edges.
    shade : (n, k) array
        Light that reaches each pair, 0..1.
    """
    n, k, _ = paths.shape
    points = np.stack([paths - across, paths + across], 2).reshape(-1, 3)
    first = np.arange(n * k * 2).reshape(n, k, 2)
    quads = np.stack([first[:, :-1, 0], first[:, :-1, 1], first[:, 1:, 1], first[:, 1:, 0]], -1)
    quads = quads.reshape(-1, 4)
    index, weights = (
        np.repeat(each if each.ndim == 3 else each[:, None].repeat(k, 1), 2, 1).reshape(
            2 * n * k, -1
        )
        for each in (index, weights)
    )
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
