"""Smoothing, against SciPy's."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from elocute.numerics.smoothing import gaussian_smoothed, smoothstep


@pytest.mark.parametrize("deviation", [0.2, 1.0, 2.0, 5.0])
def test_gaussian(deviation: float):
    values = np.random.default_rng(0).normal(size=(30, 2, 3))
    reach = max(1, round(3 * deviation))
    theirs = gaussian_filter1d(values, deviation, axis=0, mode="nearest", radius=reach)
    assert np.allclose(gaussian_smoothed(values, deviation), theirs)


def test_one_series():
    assert np.allclose(gaussian_smoothed(np.full(9, 2.0), 1.5), 2.0)


def test_smoothstep_starts_and_ends_at_rest():
    share = np.linspace(0, 1, 101)
    found = smoothstep(share)
    slopes = np.gradient(found, share, edge_order=2)
    assert found[[0, 50, 100]].tolist() == [0, 0.5, 1]
    assert np.allclose(slopes, 6 * share * (1 - share), atol=1e-3)
