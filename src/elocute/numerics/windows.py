"""Windows of short-time spectra."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def hann(length: int) -> NDArray[np.float64]:
    """(length,) periodic Hann window, as `scipy.signal.windows.hann(length, sym=False)`."""
    return 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(length) / length)
