"""Rigid alignment, against SciPy's."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elocute.numerics.rigid_alignment import nearest_rotation, rigid_alignment, turned_degrees

RNG = np.random.default_rng(3)
SOURCE = RNG.normal(size=(40, 3))
TURN = Rotation.from_rotvec([0.4, -1.1, 2.0])
TARGET = TURN.apply(SOURCE) + np.array([1.0, -2.0, 0.5]) + RNG.normal(0, 0.05, SOURCE.shape)
WEIGHTS = RNG.uniform(0.1, 2, 40)


@pytest.mark.parametrize("weights", [None, WEIGHTS])
def test_rotation_and_shift_equal_scipys(weights: np.ndarray | None):
    rotation, shift = rigid_alignment(SOURCE, TARGET, weights)
    shares = np.ones(40) if weights is None else weights
    middle, goal = (np.average(points, axis=0, weights=shares) for points in (SOURCE, TARGET))
    theirs = Rotation.align_vectors(TARGET - goal, SOURCE - middle, weights=shares)[0]
    assert np.allclose(rotation, theirs.as_matrix())
    assert np.allclose(shift, goal - rotation @ middle)
    assert np.linalg.norm(SOURCE @ rotation.T + shift - TARGET, axis=1).max() < 0.3


def test_a_mirror_image_is_turned_and_not_mirrored():
    rotation, _ = rigid_alignment(SOURCE, SOURCE * [-1, 1, 1])
    assert np.linalg.det(rotation) == pytest.approx(1)


def test_the_scale_of_the_similarity():
    target = 2.5 * TARGET
    source, goal = SOURCE - SOURCE.mean(axis=0), target - target.mean(axis=0)
    rotation, reach = nearest_rotation((goal.T @ source)[None])
    theirs = Rotation.align_vectors(goal, source)[0]
    scale = np.linalg.lstsq(theirs.apply(source).reshape(-1, 1), goal.ravel())[0][0]
    assert reach[0] / (source**2).sum() == pytest.approx(scale)
    assert np.allclose(rotation[0], theirs.as_matrix())


@pytest.mark.parametrize("degrees", [0, 0.5, 90, 180])
def test_how_far_a_rotation_turns(degrees: float):
    turn = Rotation.from_rotvec(np.radians(degrees) * np.array([0.6, 0.0, 0.8]))
    assert turned_degrees(turn.as_matrix()) == pytest.approx(degrees, abs=1e-5)
