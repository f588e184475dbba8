"""Viterbi over states that last at least two rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def best_paths(scores: NDArray[np.float32], switch: float) -> NDArray[np.int64]:
    """The best sequence of states of each window, by scores (window, row, state).

    Scores are logarithms of how well each state fits each row; a change of states costs `switch`.

    Returns
    -------
    (window, row) int64
        A state is entered at its first of two ages and left from its second.
    """
    windows, rows, states = scores.shape
    young, old = scores[:, 0].copy(), scores[:, 0].copy()
    entered_from = np.zeros((rows, windows), np.int64)
    stayed = np.zeros((rows, windows, states), np.bool_)
    best, cost = np.arange(windows), scores.dtype.type(switch)
    for row in range(1, rows):
        entered_from[row] = from_state = old.argmax(axis=1)
        entering = old[best, from_state] - cost
        np.greater(old, young, out=stayed[row])
        old = np.maximum(old, young) + scores[:, row]
        young = entering[:, None] + scores[:, row]
    path = np.empty((windows, rows), np.int64)
    state = old.argmax(axis=1)
    is_old = np.ones(windows, np.bool_)
    for row in range(rows - 1, -1, -1):
        path[:, row] = state
        before = is_old & stayed[row, best, state]
        turned = ~is_old  # entered at this row
        state = np.where(turned, entered_from[row], state)
        is_old = turned | before
    return path
