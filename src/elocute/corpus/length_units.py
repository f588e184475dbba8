"""Units of length, recognised by the size of a head."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

UNITS = {"mm": 0.001, "cm": 0.01, "dm": 0.1, "inch": 0.0254}
HEIGHT_RANGE_M = (0.1, 0.6)  # from a mask of the face to a head with shoulders
TYPICAL_HEIGHT_M = 0.25


def longest_side(template: NDArray[np.floating]) -> float:
    """Longest side of the box around vertices.

    Parameters
    ----------
    template : (vertex, 3) float
        In any unit; points that are not finite do not count.

    Returns
    -------
    float
        In the same unit; NaN without a finite point.
    """
    finite = template[np.isfinite(template).all(axis=1)]
    return float(np.ptp(finite, axis=0).max()) if len(finite) else float("nan")


def is_head_sized(size: float) -> bool:
    """Whether something whose longest side is `size` m is as large as a head may be."""
    return HEIGHT_RANGE_M[0] <= size <= HEIGHT_RANGE_M[1]


def fitting_unit(size: float) -> str:
    """The unit, of `UNITS`, in which something has most nearly the size of a head; "" for none."""
    fits = {name: size * metres for name, metres in UNITS.items() if is_head_sized(size * metres)}
    return min(fits, key=lambda name: abs(np.log(fits[name] / TYPICAL_HEIGHT_M)), default="")
