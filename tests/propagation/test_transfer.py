"""Parameters along hand-made paths."""

from __future__ import annotations

import numpy as np
import pytest

from elocute.errors import AlignmentError
from elocute.propagation.word_job import transfer_parameters

VALUES = np.array([[0, 10], [2, 20], [4, 30], [8, 40]], np.float32)


def path(*steps: tuple[int, int]) -> np.ndarray:
    return np.array(steps, np.intp)


def test_identity():
    steps = path((0, 0), (1, 1), (2, 2), (3, 3))
    assert np.array_equal(transfer_parameters(VALUES, steps, 4), VALUES)


def test_the_mean_over_many_source_frames():
    steps = path((0, 0), (1, 0), (2, 0), (3, 1))
    assert np.array_equal(transfer_parameters(VALUES, steps, 2), [[2, 20], [8, 40]])


def test_a_copy_to_many_target_frames():
    steps = path((0, 0), (1, 1), (1, 2), (1, 3), (2, 4), (3, 5))
    assert np.array_equal(transfer_parameters(VALUES, steps, 6), VALUES[[0, 1, 1, 1, 2, 3]])


def test_both_in_one_path():
    steps = path((0, 0), (1, 0), (2, 1), (2, 2), (3, 2))
    assert np.array_equal(transfer_parameters(VALUES, steps, 3), [[1, 15], [4, 30], [6, 35]])


@pytest.mark.parametrize(
    ("steps", "targets", "says"),
    [
        (path((0, 0), (3, 2)), 3, "no source for target frame 1"),
        (path((0, 0), (4, 1)), 2, "up to frames 4, 1"),
        (path((0, 0), (1, 1)), 1, "up to frames 1, 1"),
        (np.zeros((0, 2), np.intp), 1, "shape"),
    ],
)
def test_paths_that_are_none(steps: np.ndarray, targets: int, says: str):
    with pytest.raises(AlignmentError, match=says):
        transfer_parameters(VALUES, steps, targets)
