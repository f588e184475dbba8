"""The objective of canonical correlation: nuclear norm of the whitened cross-covariance.

Tzirakis et al. 2019, Eqs. 4 to 8; `dcaw.correlation` sums it over all pairs of sets (Eq. 9).
Features here are (frame, feature), the paper's transposed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float64Array
from elocute.errors import AlignmentError
from elocute.one_line_repr import one_line

RIDGE = 1e-3


@dataclass(frozen=True, eq=False)
class WhitenedPair:
    """K = Σ11^-½ Σ12 Σ22^-½ = U S Vᵀ of two views of equally many frames, and its factors."""

    views: tuple[Float64Array, Float64Array]  # centred
    roots: tuple[Float64Array, Float64Array]  # Σ11^-½, Σ22^-½
    u: Float64Array
    s: Float64Array
    v: Float64Array

    __repr__ = one_line

    @property
    def norm(self) -> float:
        """The nuclear norm, Eq. 5: at most the smaller number of features."""
        return float(self.s.sum())

    def gradients(self) -> tuple[Float64Array, Float64Array]:
        """The sub-gradient of the norm by each view (frame, feature), Eqs. 6 to 8."""
        (first, second), (one, other) = self.views, self.roots
        across = one @ self.u @ self.v.T @ other
        within = one @ (self.u * self.s) @ self.u.T @ one
        within_other = other @ (self.v * self.s) @ self.v.T @ other
        share = 1 / (len(first) - 1)
        return share * (second @ across.T - first @ within), share * (
            first @ across - second @ within_other
        )


def whiten_pair(first: Float64Array, second: Float64Array, ridge: float = RIDGE) -> WhitenedPair:
    """Whiten two views; `ridge` on the diagonals of Σ11 and Σ22 allows for constant features.

    Raises AlignmentError where the views do not have equally many frames, two at least.
    """
    if first.ndim != 2 or second.ndim != 2 or len(first) != len(second) or len(first) < 2:
        raise AlignmentError.about(
            "correlated views",
            found=f"shapes {first.shape} and {second.shape}",
            allowed="(frame, feature) of equally many frames, two or more",
        )
    if not ridge > 0:
        raise AlignmentError.about("ridge", found=f"{ridge}", allowed="above 0")
    views = tuple(view - view.mean(axis=0) for view in map(np.float64, (first, second)))
    roots = tuple(inverse_root(view.T @ view / (len(view) - 1), ridge) for view in views)
    cross = views[0].T @ views[1] / (len(first) - 1)
    u, s, vt = np.linalg.svd(roots[0] @ cross @ roots[1], full_matrices=False)
    return WhitenedPair((views[0], views[1]), (roots[0], roots[1]), u, s, vt.T)


def inverse_root(covariance: Float64Array, ridge: float) -> Float64Array:
    """(covariance + ridge)^-½, symmetric."""
    values, vectors = np.linalg.eigh(covariance + ridge * np.eye(len(covariance)))
    return (vectors / np.sqrt(np.maximum(values, ridge))) @ vectors.T
