"""Cubics without overshoot, against SciPy's."""

import numpy as np
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from elocute.numerics.monotone_cubic import monotone_cubic


def knots(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.uniform(0.05, 1, 12)), rng.uniform(0, 1, (12, 3))


def test_scipys_slopes_but_at_rest_at_both_ends():
    times, values = knots(0)
    slopes = PchipInterpolator(times, values, axis=0).derivative()(times)
    slopes[[0, -1]] = 0
    at = np.linspace(times[0], times[-1], 500)
    assert np.allclose(
        monotone_cubic(times, values, at), CubicHermiteSpline(times, values, slopes)(at)
    )


def test_nothing_overshoots_and_equal_knots_stay_equal():
    times, values = knots(1)
    values[4:6, 0] = 0
    found = monotone_cubic(times, values, np.linspace(times[0], times[-1], 2000))
    assert found.min() >= values.min() - 1e-12 and found.max() <= values.max() + 1e-12
    between = monotone_cubic(times, values, np.linspace(times[4], times[5], 50))
    assert (between[:, 0] == 0).all()


def test_end_values_hold_and_one_knot_is_everywhere():
    times, values = knots(2)
    assert np.allclose(monotone_cubic(times, values, np.array([-9.0, 99.0])), values[[0, -1]])
    assert (monotone_cubic(times[:1], values[:1], np.array([0.0, 5.0])) == values[:1]).all()
