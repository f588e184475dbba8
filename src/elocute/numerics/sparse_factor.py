"""Factors of sparse matrices. Needs SciPy."""

from __future__ import annotations

from typing import Any


def factor_of(matrix: Any) -> Any:
    """Of a sparse, positive definite matrix (csc): its `solve` takes the right side."""
    from scipy.sparse.linalg import splu

    # No pivoting is needed, and the order of a symmetric matrix fills in least.
    return splu(
        matrix,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
