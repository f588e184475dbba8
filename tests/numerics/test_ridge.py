"""Ridge projection, against ordinary least squares on a problem with the ridge as rows."""

import numpy as np

from elocute.numerics.ridge import ridge_coefficients, ridge_projection, with_ridge

SHAPES = np.random.default_rng(7).normal(size=(6, 90))
TARGET = np.random.default_rng(8).normal(size=90)


def by_rows(cost: float) -> np.ndarray:
    rows = np.concatenate([SHAPES.T, np.sqrt(cost) * np.eye(6)])
    return np.linalg.lstsq(rows, np.concatenate([TARGET, np.zeros(6)]))[0]


def test_coefficients_cost_what_they_cost():
    assert np.allclose(ridge_coefficients(SHAPES, TARGET, 25.0), by_rows(25.0))


def test_the_projection_is_the_same_as_a_matrix():
    cost = 0.1 * np.trace(SHAPES @ SHAPES.T) / 6
    assert np.allclose(TARGET @ ridge_projection(SHAPES, 0.1), by_rows(cost))


def test_what_shapes_span_comes_back():
    weights = np.array([[0.5, 0, -1, 2, 0, 0.25]])
    assert np.abs(weights @ SHAPES @ ridge_projection(SHAPES) - weights).max() < 1e-7


def test_shapes_that_are_the_same_share_the_weight():
    twins = np.concatenate([SHAPES, SHAPES[:1]])
    found = SHAPES[0] @ ridge_projection(twins)
    assert np.allclose(found[[0, 6]], 0.5, atol=1e-3)
    assert np.linalg.cond(with_ridge(twins @ twins.T, 0.01)) < 1e4
