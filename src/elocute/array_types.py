"""Names for arrays by their dtype, one meaning each; shapes stand in docstrings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float32Array = NDArray[np.float32]
Float64Array = NDArray[np.float64]
FloatArray = NDArray[np.floating]
"""Of any precision."""
IntArray = NDArray[np.integer]
"""Of any size."""
RealArray = NDArray[np.floating] | NDArray[np.integer]
