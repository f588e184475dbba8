"""Least-squares projection onto shapes, steadied by a ridge on the coefficients."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import FloatArray

SMALLEST = 1e-9
"""A ridge that only decides between shapes that are the same."""


def with_ridge(gram: FloatArray, share: float) -> NDArray[np.float64]:
    """A Gram matrix (component, component) whose diagonal is raised by a share of its mean.

    The share is relative to the mean squared length of a shape. The ridge decides between shapes
    that look alike, and makes the matrix invertible.
    """
    return gram + share * np.trace(gram) / len(gram) * np.eye(len(gram))


def ridge_projection(shapes: FloatArray, share: float = SMALLEST) -> NDArray[np.float64]:
    """The matrix P (number, component) from vectors to the coefficients of shapes nearest to them.

    With shapes (component, number), `vectors @ P` minimises |vectors - coefficients · shapes|² plus
    the ridge, of a share as in `with_ridge`.
    """
    flat = np.asarray(shapes, np.float64)
    return np.asarray(np.linalg.solve(with_ridge(flat @ flat.T, share), flat).T, np.float64)


def ridge_coefficients(shapes: FloatArray, target: FloatArray, cost: float) -> NDArray[np.float64]:
    """c (component,) that minimises |target - c · shapes|² + cost · |c|².

    Shapes are (component, number), the target (number,); the cost is in the squared unit of the
    target.
    """
    gram = shapes @ shapes.T + cost * np.eye(len(shapes))
    return np.asarray(np.linalg.solve(gram, shapes @ target), np.float64)
