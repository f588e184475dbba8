"""What checks docstrings at every call of the tests: it must see what is wrong."""

from __future__ import annotations

import numpy as np
import pytest

from elocute.motion.curves import Curves
from tests.support.documented_shapes import ShapeError, checked


def distances(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Distances between points.

    Parameters
    ----------
    points, others : (point, 3) float32
        Metres.

    Returns
    -------
    (point,) float32
    """
    return np.linalg.norm(points[:, :3] - others[:, :3], axis=1)


def call(*shapes: tuple[int, ...], dtype: type = np.float32) -> np.ndarray:
    function = checked(distances, distances.__doc__.replace("    ", ""), "distances")  # type: ignore[union-attr]
    return function(*(np.zeros(shape, dtype) for shape in shapes))


def test_what_agrees_with_its_docstring_passes() -> None:
    assert call((5, 3), (5, 3)).shape == (5,)


@pytest.mark.parametrize(
    ("shapes", "dtype", "told"),
    [
        (((5, 4), (5, 4)), np.float32, r"`points`: \(5, 4\)"),
        (((5, 3), (1, 3)), np.float32, r"`others`: .* point = 5"),
        (((5, 3), (5, 3)), np.float64, r"returns: \(5,\) float64"),
    ],
)
def test_what_differs_is_told(shapes: tuple, dtype: type, told: str) -> None:
    with pytest.raises(ShapeError, match=told):
        call(*shapes, dtype=dtype)


def test_the_package_is_watched() -> None:
    assert hasattr(Curves.__init__, "__wrapped__")
