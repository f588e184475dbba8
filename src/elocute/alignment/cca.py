"""Canonical correlation analysis: directions in which views correlate, and its objective.

The objective is the nuclear norm of the whitened cross-covariance (Tzirakis et al. 2019, Eqs. 4 to
8); `dcaw.correlation` sums it over all pairs of sets (Eq. 9). Features here are (frame, feature),
the paper's transposed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

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


CORRELATION_MIN, CORRELATION_MAX = 1e-3, 0.98
"""With few frames any correlation may reach one; the limit keeps one direction from outweighing
all others."""


@dataclass(frozen=True, eq=False)
class LinearProjection:
    """x → (x - mean) @ directions: an affine map of one view."""

    mean: Float64Array
    directions: Float64Array

    __repr__ = one_line

    def __call__(self, view: NDArray[np.floating]) -> NDArray[np.float32]:
        return ((view - self.mean) @ self.directions).astype(np.float32)

    def then(self, second: LinearProjection) -> LinearProjection:
        """One projection that does this one, then the second."""
        return LinearProjection(
            self.mean + second.mean @ np.linalg.pinv(self.directions),
            self.directions @ second.directions,
        )


def canonical_projections(
    views: Sequence[Float64Array], dimensions: int, ridge: float
) -> tuple[LinearProjection, ...]:
    """Projections of views, which match frame by frame, onto their common directions.

    Of two views classical CCA, of more its multi-set form (the sum of all correlations, views
    whitened one by one). Each direction is weighted so that squared distances between projections
    are those of probabilistic CCA (Bach & Jordan 2005): s / (1 - s²) for the mean correlation s.
    """
    centred = [view - view.mean(axis=0, dtype=np.float64) for view in views]
    roots = [inverse_root(x.T @ x / max(len(x) - 1, 1), ridge) for x in centred]
    white = np.concatenate([x @ root for x, root in zip(centred, roots, strict=True)], axis=1)
    edges = np.cumsum([0, *(view.shape[1] for view in views)])
    across = white.T @ white / max(len(white) - 1, 1)
    for start, end in pairwise(edges):
        across[start:end, start:end] = 0
    values, vectors = np.linalg.eigh(across)
    count = min(dimensions, *(view.shape[1] for view in views))
    s = np.clip(values[::-1][:count] / (len(views) - 1), CORRELATION_MIN, CORRELATION_MAX)
    scale = np.sqrt(len(views) * s / (1 - s**2))
    top = vectors[:, ::-1][:, :count] * scale
    return tuple(
        LinearProjection(view.mean(axis=0, dtype=np.float64), root @ top[start:end])
        for view, root, (start, end) in zip(views, roots, pairwise(edges), strict=True)
    )


def principal_projection(views: Sequence[NDArray[np.floating]], share: float) -> LinearProjection:
    """Principal components that hold this share of the variance of all views, each of variance one.

    Components below a thousandth of the largest are left out, whatever the share.
    """
    stacked = np.concatenate(views).astype(np.float64)
    mean = stacked.mean(axis=0)
    _, s, vt = np.linalg.svd(stacked - mean, full_matrices=False)
    held = np.cumsum(s**2) / max(float((s**2).sum()), 1e-30)
    count = max(1, min(int(np.searchsorted(held, share) + 1), int((s > 1e-3 * s[0]).sum())))
    deviation = np.maximum(s[:count] / np.sqrt(max(len(stacked) - 1, 1)), 1e-9)
    return LinearProjection(mean, vt[:count].T / deviation)


def overall_correlation(first: NDArray[np.floating], second: NDArray[np.floating]) -> float:
    """Correlation of two (frame, feature) arrays, all features together, 0 to 1.

    Each feature is taken about its own mean, and counts by how much it moves. Where one of them
    does not move at all, views that are equal correlate fully and others not at all.
    """
    a, b = (
        np.asarray(x, np.float64) - np.mean(x, axis=0, dtype=np.float64) for x in (first, second)
    )
    power = float(np.sqrt((a * a).sum() * (b * b).sum()))
    if power < 1e-9:
        return float(np.allclose(first, second, rtol=1e-5, atol=1e-6))
    return float(np.clip((a * b).sum() / power, 0, 1))
