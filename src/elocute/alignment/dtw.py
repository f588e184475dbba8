"""Dynamic time warping: the cheapest monotone path through a matrix of costs.

Steps are (1, 0), (0, 1) and (1, 1), each at the cost of the cell it enters (Sakoe & Chiba 1978,
symmetric without weights). Among equals the diagonal wins.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from elocute.alignment.alignment import WarpingPath
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
