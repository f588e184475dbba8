"""Units of length, told by the size of a head."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

UNITS = {"mm": 0.001, "cm": 0.01, "dm": 0.1, "inch": 0.0254}
HEIGHT_RANGE_M = (0.1, 0.6)  # from a mask of the face to a head with shoulders
TYPICAL_HEIGHT_M = 0.25


def longest_side(template: NDArray[np.floating]) -> float:
    """Longest side of the box around vertices (vertex, 3), in their own unit; NaN for none."""
    finite = template[np.isfinite(template).all(axis=1)]
    return float(np.ptp(finite, axis=0).max()) if len(finite) else float("nan")


def is_head_sized(size: float) -> bool:
    return HEIGHT_RANGE_M[0] <= size <= HEIGHT_RANGE_M[1]


def fitting_unit(size: float) -> str:
    """The unit in which a head of this height would be most like a head, or ""."""
    fits = {name: size * metres for name, metres in UNITS.items() if is_head_sized(size * metres)}
    return min(fits, key=lambda name: abs(np.log(fits[name] / TYPICAL_HEIGHT_M)), default="")
