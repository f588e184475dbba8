"""Dynamic time warping: the cheapest monotone path through a matrix of costs, and soft-DTW.

Steps are (1, 0), (0, 1) and (1, 1), each at the cost of the cell it enters (Sakoe & Chiba 1978,
symmetric without weights). Among equals the diagonal wins. Soft-DTW (Cuturi & Blondel 2017) is a
smooth minimum over all paths; its gradient by the costs is how often each cell is passed by a path
drawn with probability proportional to exp(-cost / gamma): the expected alignment.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from elocute.alignment.alignment import WarpingPath
from elocute.array_types import Float64Array
from elocute.errors import AlignmentError

CostMatrix = NDArray[np.floating]
ROUNDING = {np.dtype(np.float32): 2e-6, np.dtype(np.float64): 1e-13}
"""A squared distance below this share of the squared lengths is rounding, and set to zero."""


def squared_distances(source: CostMatrix, target: CostMatrix) -> CostMatrix:
    """(source frame, target frame) squared Euclidean distances, by one matrix product."""
    products = source @ target.T
    tiny = ROUNDING[products.dtype]
    lengths = np.einsum("ij,ij->i", source, source), np.einsum("ij,ij->i", target, target)
    _distances_of(products, *lengths, tiny)
    return products


def dtw(
    cost: CostMatrix, band: float | None = None, open_source: bool = False
) -> tuple[WarpingPath, float]:
    """The cheapest path (step, 2) through cost (source frame, target frame), and what it costs.

    band: how far from the diagonal it may go, in frames of the longer view (1 or more), or as a
    share of it (below 1); None for anywhere. open_source: it may begin and end at any source
    frame (the target is to be found in the source). Raises AlignmentError.
    """
    if cost.ndim != 2 or not cost.size:
        raise AlignmentError.about("cost", found=f"shape {cost.shape}", allowed="(source, target)")
    low, high = _limits(cost.shape, band, open_source)
    total = _accumulate(np.ascontiguousarray(cost), low, high, open_source)
    end = int(np.argmin(total[:, -1])) if open_source else len(cost) - 1
    if not np.isfinite(total[end, -1]):
        raise AlignmentError.about("cost", found="no finite path", allowed="finite costs")
    return _traced(total, end, open_source), float(total[end, -1])


def _limits(
    shape: tuple[int, ...], band: float | None, open_source: bool
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First column of each row that a path may take, and the one after the last."""
    rows, columns = shape
    everywhere = np.zeros(rows, np.intp), np.full(rows, columns, np.intp)
    if band is None:
        return everywhere
    if not (np.isfinite(band) and band > 0) or open_source:
        raise AlignmentError.about(
            "band",
            found=f"{band}" + (" with open ends" if open_source else ""),
            allowed="frames (1 or more) or a share (below 1), whole against whole",
        )
    longest = max(rows, columns)
    frames = max(1.0, band * longest if band < 1 else band)
    slope = (columns - 1) / max(rows - 1, 1)
    # Wide enough that neighbouring rows always touch.
    reach = max(frames * columns / longest, slope, 1.0)
    middle = np.arange(rows) * slope
    low = np.clip(np.ceil(middle - reach), 0, columns - 1).astype(np.intp)
    high = np.clip(np.floor(middle + reach) + 1, 1, columns).astype(np.intp)
    if rows == 1:
        return everywhere
    return low, high


@njit(cache=True)
def _distances_of(products, source, target, tiny):
    for i in range(products.shape[0]):
        for j in range(products.shape[1]):
            both = source[i] + target[j]
            value = both - 2 * products[i, j]
            products[i, j] = value if value > tiny * both else 0


@njit(cache=True)
def _accumulate(cost, low, high, open_source):
    """(source, target): cost of the cheapest way to each cell."""
    rows, columns = cost.shape
    total = np.full((rows, columns), np.inf)
    for i in range(rows):
        left = np.inf
        for j in range(low[i], high[i]):
            if j == 0 and (i == 0 or open_source):
                best = 0.0
            else:
                best = left
                if i > 0:
                    above = total[i - 1, j]
                    if above < best:
                        best = above
                    if j > 0:
                        corner = total[i - 1, j - 1]
                        if corner < best:
                            best = corner
            left = best + cost[i, j]
            total[i, j] = left
    return total


@njit(cache=True)
def _traced(total, end, open_source):
    """The path back from (end, last), turned round."""
    i, j = end, total.shape[1] - 1
    steps = np.empty((i + j + 1, 2), np.intp)
    count = 0
    while True:
        steps[count, 0], steps[count, 1] = i, j
        count += 1
        if j == 0 and (i == 0 or open_source):
            break
        if i == 0:
            j -= 1
        elif j == 0:
            i -= 1
        else:
            corner, above, left = total[i - 1, j - 1], total[i - 1, j], total[i, j - 1]
            if corner <= above and corner <= left:
                i, j = i - 1, j - 1
            elif above <= left:
                i -= 1
            else:
                j -= 1
    return steps[:count][::-1].copy()


def soft_dtw(
    cost: CostMatrix, gamma: float, open_source: bool = False
) -> tuple[float, Float64Array]:
    """The soft minimum and the expected alignment (source frame, target frame).

    gamma is in the unit of the costs; towards 0 it is DTW. Raises AlignmentError.
    """
    if cost.ndim != 2 or not cost.size or not np.isfinite(cost).all():
        raise AlignmentError.about(
            "cost", found=f"shape {cost.shape}", allowed="(source, target), finite"
        )
    if not (np.isfinite(gamma) and gamma > 0):
        raise AlignmentError.about("gamma", found=f"{gamma}", allowed="above 0")
    scaled = np.ascontiguousarray(cost, np.float64) / gamma
    forward, value = _forward(scaled, open_source)
    return gamma * float(value), _expected(scaled, forward, value, open_source)


def soft_path(
    expected: Float64Array, band: float | None = None, open_source: bool = False
) -> WarpingPath:
    """The most probable path, each cell taken by itself.

    A cell costs minus the logarithm of its expectation, so an improbable step is never made for
    the sake of a longer path.
    """
    return dtw(-np.log(np.clip(expected, 1e-12, 1.0)), band, open_source)[0]


@njit(cache=True)
def _soft_minimum(a, b, c):
    least = min(a, b, c)
    if least == np.inf:
        return np.inf
    return least - np.log(np.exp(least - a) + np.exp(least - b) + np.exp(least - c))


@njit(cache=True)
def _forward(cost, open_source):
    """Soft minimum over ways to each cell, in units of gamma, and over all of them."""
    rows, columns = cost.shape
    soft = np.full((rows + 1, columns + 1), np.inf)
    soft[0, 0] = 0.0
    for i in range(1, rows + 1):
        if open_source:
            soft[i, 0] = 0.0
        for j in range(1, columns + 1):
            # With open ends a way begins at (i, 1) from nothing: only the corner is its start.
            left = soft[i, j - 1] if j > 1 or not open_source else np.inf
            best = _soft_minimum(soft[i - 1, j - 1], soft[i - 1, j], left)
            soft[i, j] = cost[i - 1, j - 1] + best
    value = soft[rows, columns]
    if open_source:
        value = np.inf
        for i in range(1, rows + 1):
            value = _soft_minimum(value, soft[i, columns], np.inf)
    return soft, value


@njit(cache=True)
def _expected(cost, soft, value, open_source):
    """The gradient, backwards: a share of each cell's weight goes to the three before it."""
    rows, columns = cost.shape
    weight = np.zeros((rows + 1, columns + 1))
    for i in range(rows, 0, -1):
        for j in range(columns, 0, -1):
            here = 0.0
            if j == columns and (open_source or i == rows):
                here = np.exp(value - soft[i, j])
            reached = soft[i, j]
            if i < rows:
                here += weight[i + 1, j] * np.exp(soft[i + 1, j] - cost[i, j - 1] - reached)
                if j < columns:
                    ahead = soft[i + 1, j + 1] - cost[i, j] - reached
                    here += weight[i + 1, j + 1] * np.exp(ahead)
            if j < columns:
                here += weight[i, j + 1] * np.exp(soft[i, j + 1] - cost[i - 1, j] - reached)
            weight[i, j] = here
    return weight[1:, 1:].copy()


PROBABILITY_MIN = 1e-8


def attention_path(
    attention: NDArray[np.floating], band: float | None = None, open_source: bool = False
) -> WarpingPath:
    """The most probable monotone path (step, 2): the cheapest through -log attention."""
    return dtw(-np.log(np.maximum(attention, PROBABILITY_MIN)), band, open_source)[0]


def expected_path(
    expected: NDArray[np.floating], band: float | None = None, open_source: bool = False
) -> WarpingPath:
    """The monotone path nearest to where frames are expected, each seen from the other view.

    expected: (source, target) how often each cell is passed. The mean source of each target frame
    and the mean target of each source frame are two curves, free of steps that a single best path
    makes where frames are alike; the path that has the least squares from both is taken.
    """
    weights = np.maximum(np.asarray(expected, np.float64), PROBABILITY_MIN)
    sources, targets = (np.arange(size) for size in weights.shape)
    source_of = sources @ weights / weights.sum(axis=0)
    target_of = weights @ targets / weights.sum(axis=1)
    # With open ends most source frames belong to no target frame, and must weigh nothing.
    weight = np.minimum(expected.sum(axis=1), 1.0)
    off = (sources[:, None] - source_of) ** 2 + weight[:, None] * (
        targets - target_of[:, None]
    ) ** 2
    return dtw(off, band, open_source)[0]


def diagonal_path(sources: int, targets: int) -> WarpingPath:
    """Frames matched in proportion, the baseline of every method."""
    count = max(sources, targets)
    return np.stack(
        [np.round(np.linspace(0, length - 1, count)) for length in (sources, targets)], axis=1
    ).astype(np.intp)


def merge_paths(paths: Sequence[WarpingPath], frames: int) -> WarpingPath:
    """Paths (step, 2) of several views against one reference of so many frames, as one.

    Columns are the views in their order, the reference last. While the reference stays at a frame,
    the other views advance together, shorter runs spread over the longest.
    """
    rows = []
    edges = [np.searchsorted(path[:, 1], np.arange(frames + 1)) for path in paths]
    for frame in range(frames):
        runs = [
            path[edge[frame] : edge[frame + 1], 0] for path, edge in zip(paths, edges, strict=True)
        ]
        count = max(map(len, runs))
        spread = [run[np.arange(count) * len(run) // count] for run in runs]
        rows.append(np.stack([*spread, np.full(count, frame)], axis=1))
    return np.concatenate(rows).astype(np.intp)
