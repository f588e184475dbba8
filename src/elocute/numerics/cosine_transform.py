"""The discrete cosine transform."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def dct_matrix(size: int) -> NDArray[np.float64]:
    """(input, output) orthonormal DCT-II: `rows @ dct_matrix(size)` transforms rows."""
    n = np.arange(size)
    matrix = np.cos(np.pi * (2 * n[:, None] + 1) * n / (2 * size)) * np.sqrt(2 / size)
    matrix[:, 0] /= np.sqrt(2)
    return matrix
