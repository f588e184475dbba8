"""Linear interpolation in time, against SciPy's."""

import numpy as np
import pytest
from scipy.interpolate import interp1d

from elocute.numerics.resampling import frame_places, frames_in, interpolate, neighbours, read_rows

ROWS = np.random.default_rng(0).normal(size=(25, 3, 2)).astype(np.float32)


@pytest.mark.parametrize(("rate", "fps", "first"), [(50, 60, 0), (60, 25, 7), (30, 29.97, 3)])
def test_rows_at_another_rate(rate: float, fps: float, first: int):
    count = 20
    found = read_rows(ROWS, frame_places(first, count, rate, fps))
    scipy = interp1d(
        np.arange(25) / rate,
        ROWS.astype(float),
        axis=0,
        bounds_error=False,
        fill_value=(ROWS[0], ROWS[-1]),  # pyright: ignore[reportArgumentType]
    )
    assert found.dtype == np.float32 and found.shape == (count, 3, 2)
    assert np.abs(found - scipy((first + np.arange(count)) / fps)).max() < 1e-6


def test_end_rows_hold_beyond_both_ends():
    assert (read_rows(ROWS, np.array([-3.0, 24.0, 99.0])) == ROWS[[0, 24, 24]]).all()


def test_one_row_is_everywhere():
    assert (read_rows(ROWS[:1], np.array([-1.0, 0.0, 2.5])) == ROWS[:1]).all()


def test_neighbours_and_the_share_of_the_second():
    below, above, share = neighbours(np.array([0.25, 2.0, 9.0]), 4)
    assert below.tolist() == [0, 2, 3] and above.tolist() == [1, 3, 3]
    assert share.tolist() == [0.25, 0, 0]


def test_knots_at_uneven_times():
    rng = np.random.default_rng(1)
    times, values = np.cumsum(rng.uniform(0.1, 1, 9)), rng.normal(size=(9, 4))
    at = np.linspace(times[0] - 1, times[-1] + 1, 50)
    scipy = interp1d(times, values, axis=0)(np.clip(at, times[0], times[-1]))
    assert np.allclose(interpolate(times, values, at), scipy)


@pytest.mark.parametrize(
    ("duration_s", "fps", "frames"), [(1.0, 60, 60), (0.1 * 3, 10, 3), (1.01, 60, 61), (0.0, 60, 1)]
)
def test_frames_cover_a_duration(duration_s: float, fps: float, frames: int):
    assert frames_in(duration_s, fps) == frames
