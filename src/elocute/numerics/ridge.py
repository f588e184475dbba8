"""Least-squares projection onto shapes, steadied by a ridge on the coefficients."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import FloatArray

SMALLEST = 1e-9
"""A ridge that only decides between shapes that are the same."""


def with_ridge(gram: FloatArray, share: float) -> NDArray[np.float64]:
    """A Gram matrix whose diagonal is raised by a share of its mean.

    Parameters
    ----------
    gram
        (component, component), shapes · shapesᵀ.
    share
        Ridge relative to the mean squared length of a shape. It decides between shapes that
        look alike, and makes the matrix invertible.

    Returns
    -------
    (component, component).
    """
    return gram + share * np.trace(gram) / len(gram) * np.eye(len(gram))


def ridge_projection(shapes: FloatArray, share: float = SMALLEST) -> NDArray[np.float64]:
    """The matrix that takes vectors to the coefficients of shapes nearest to them.

    Parameters
    ----------
    shapes
        (component, number), rows.
    share
        Ridge as in `with_ridge`.

    Returns
    -------
    (number, component) P: `vectors @ P` minimises |vectors - coefficients · shapes|² plus the
    ridge.
    """
    flat = np.asarray(shapes, np.float64)
    return np.asarray(np.linalg.solve(with_ridge(flat @ flat.T, share), flat).T, np.float64)


def ridge_coefficients(shapes: FloatArray, target: FloatArray, cost: float) -> NDArray[np.float64]:
    """c that minimises |target - c · shapes|² + cost · |c|².

    Parameters
    ----------
    shapes
        (component, number), rows.
    target
        (number,).
    cost
        Of a squared coefficient, in the squared unit of the target.

    Returns
    -------
    (component,).
    """
    gram = shapes @ shapes.T + cost * np.eye(len(shapes))
    return np.asarray(np.linalg.solve(gram, shapes @ target), np.float64)
