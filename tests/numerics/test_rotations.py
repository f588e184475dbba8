"""Quaternions and rotation vectors, against SciPy's."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from elocute.numerics import quaternions, rotation_vectors

VECTORS = np.random.default_rng(2).normal(size=(50, 3)) * 1.5
VECTORS[:3] = [[0, 0, 0], [1e-12, 0, 0], [0, 1e-5, 0]]
TURNS = Rotation.from_rotvec(VECTORS)


def wxyz(turns: Rotation) -> np.ndarray:
    return turns.as_quat(canonical=True)[..., [3, 0, 1, 2]]


def same(first: np.ndarray, second: np.ndarray) -> bool:
    """q and -q are the same rotation."""
    return bool(np.allclose(np.abs((first * second).sum(axis=-1)), 1))


def test_to_and_from_rotation_vectors():
    found = quaternions.from_axis_angle(VECTORS)
    assert same(found, wxyz(TURNS))
    assert np.allclose(quaternions.to_axis_angle(found), TURNS.as_rotvec())


@pytest.mark.parametrize("vector", [(0, 0, 0), (1e-9, 0, 0), (0, np.pi, 0)])
def test_there_and_back_at_the_ends_of_the_range(vector: tuple[float, ...]):
    there = quaternions.from_axis_angle(np.array(vector))
    assert np.allclose(quaternions.to_axis_angle(there), vector, atol=1e-12)


def test_to_and_from_matrices():
    matrices = TURNS.as_matrix()
    assert np.allclose(quaternions.to_matrices(wxyz(TURNS)), matrices)
    assert same(quaternions.from_matrices(matrices), wxyz(TURNS))
    assert np.allclose(rotation_vectors.to_matrices(VECTORS), matrices)


def test_one_after_the_other():
    first, second = TURNS[:25], TURNS[25:]
    assert same(quaternions.multiply(wxyz(second), wxyz(first)), wxyz(second * first))


def test_blend_of_near_neighbours_is_slerp():
    near = Rotation.from_rotvec([[0.5, 0.2, 0.1], [0.55, 0.1, 0.12]])
    one, other = wxyz(near)
    for share in (0.0, 0.3, 1.0):
        theirs = wxyz(Slerp([0, 1], near)(share))
        assert np.allclose(quaternions.blend(one, -other, np.array([share])), theirs, atol=1e-5)


def test_cross_products():
    others = VECTORS[::-1]
    found = np.einsum("nab,nb->na", rotation_vectors.cross_matrices(VECTORS), others)
    assert np.allclose(found, np.cross(VECTORS, others))


@pytest.mark.parametrize("shape", [(4,), (2, 5)])
def test_no_turn(shape: tuple[int, ...]):
    found = quaternions.no_turn(*shape)
    assert found.shape == (*shape, 4)
    assert np.allclose(quaternions.to_matrices(found), np.eye(3))
