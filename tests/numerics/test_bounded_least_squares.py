"""Least squares between bounds, against SciPy's."""

import numpy as np
import pytest
from scipy.optimize import LinearConstraint, lsq_linear, minimize

from elocute.numerics.bounded_least_squares import (
    solve_box,
    solve_box_chain,
    solve_box_rows,
    solve_box_sum,
)


def drawn(unknowns: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """(equation, unknown) shapes, (row, equation) targets that often lie beyond the bounds."""
    rng = np.random.default_rng(5)
    return rng.normal(size=(60, unknowns)), rng.normal(size=(8, 60)) * 3


def by_scipy(shapes: np.ndarray, target: np.ndarray, low: float, high: float) -> np.ndarray:
    return lsq_linear(shapes, target, (low, high), method="bvls", tol=1e-14).x


@pytest.mark.parametrize("unknowns", [1, 3, 12, 30])
def test_each_row_equals_scipys(unknowns: int):
    shapes, targets = drawn(unknowns)
    theirs = np.stack([by_scipy(shapes, target, -0.1, 0.3) for target in targets])
    assert (np.isclose(theirs, -0.1) | np.isclose(theirs, 0.3)).any()
    gram, sides = shapes.T @ shapes, targets @ shapes
    low, high = np.full(unknowns, -0.1), np.full(unknowns, 0.3)
    one_by_one = np.stack([solve_box(gram, side, low, high) for side in sides])
    assert np.abs(one_by_one - theirs).max() < 1e-8
    assert np.abs(solve_box_rows(gram, sides, -0.1, 0.3) - theirs).max() < 1e-6


def test_a_sum_is_kept_and_the_rest_is_the_best_beside_it():
    shapes, targets = drawn()
    gram, group = shapes.T @ shapes, np.array([1.0] * 7 + [0.0] * 5)
    low, high = np.zeros(12), np.ones(12)
    low[3] = 0.4
    for side in targets @ shapes * 8:
        found = solve_box_sum(gram, side, low, high, group)
        theirs = minimize(
            lambda x, side=side: x @ gram @ x / 2 - side @ x,
            np.clip(low, 0, 1),
            jac=lambda x, side=side: gram @ x - side,
            method="trust-constr",
            bounds=list(zip(low, high, strict=True)),
            constraints=[LinearConstraint(group[None], -np.inf, 1.0)],
            options={"gtol": 1e-10, "xtol": 1e-12, "maxiter": 2000},
        ).x
        assert group @ found <= 1
        assert np.abs(found - theirs).max() < 1e-3
    loose = solve_box_sum(gram, targets[0] @ shapes * 0.01, low, high, group)
    assert (loose == solve_box(gram, targets[0] @ shapes * 0.01, low, high)).all()


def test_without_bounds_it_is_least_squares():
    shapes, targets = drawn()
    free = np.full(12, np.inf)
    found = solve_box(shapes.T @ shapes, targets[0] @ shapes, -free, free)
    assert np.allclose(found, np.linalg.lstsq(shapes, targets[0])[0])


def test_a_chain_equals_one_large_problem():
    shapes, targets = drawn()
    frames, unknowns, smooth = len(targets), 12, 40.0
    change = np.sqrt(smooth) * np.kron(np.diff(np.eye(frames), axis=0), np.eye(unknowns))
    whole = np.concatenate([np.kron(np.eye(frames), shapes), change])
    wanted = np.concatenate([targets.ravel(), np.zeros(len(change))])
    theirs = by_scipy(whole, wanted, 0, 0.2).reshape(frames, unknowns)
    found = solve_box_chain(
        lambda frame: shapes.T @ shapes,
        targets @ shapes,
        np.full(unknowns, smooth),
        np.zeros(unknowns),
        np.full(unknowns, 0.2),
        sweeps=60,
    )
    assert np.abs(found - theirs).max() < 1e-6
