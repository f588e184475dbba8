"""Features over time: resampling and the windows of VOCA."""

import numpy as np
import pytest

from elocute.audio import Features
from elocute.errors import InputError


def ramp(count: int, rate: float = 50) -> Features:
    """Each value is its own time in seconds."""
    return Features((np.arange(count)[:, None] / rate).astype(np.float32), rate, "ramp")


@pytest.mark.parametrize("rate", [30, 60, 100, 23.976, 50])
def test_resampling_keeps_time(rate):
    resampled = ramp(500).resample(rate)
    assert len(resampled.values) == round(10 * rate)
    inside = np.arange(len(resampled.values)) / rate <= 499 / 50
    times = np.arange(len(resampled.values))[inside] / rate
    np.testing.assert_allclose(resampled.values[inside, 0], times, atol=1e-6)
    assert (resampled.rate, resampled.encoder) == (rate, "ramp")


def test_the_last_value_holds():
    assert ramp(50).resample(60).values[-1, 0] == np.float32(0.98)


def test_resampling_equals_numpys_interpolation():
    values = np.random.default_rng(0).normal(size=(101, 29)).astype(np.float32)
    ours = Features(values, 50, "noise").resample(60).values
    at = np.arange(len(ours)) / 60
    theirs = [np.interp(at, np.arange(101) / 50, column) for column in values.T]
    np.testing.assert_allclose(ours, np.transpose(theirs), atol=1e-6)


def test_windows_cover_eight_frames_before_and_seven_after():
    windows = Features(np.arange(1, 41, dtype=np.float32)[:, None], 60, "count").windows(16)
    assert windows.shape == (40, 16, 1)
    assert windows[20, :, 0].tolist() == list(range(13, 29))
    assert windows[0, :, 0].tolist() == [0] * 8 + list(range(1, 9))
    assert windows[39, :, 0].tolist() == list(range(32, 41)) + [0] * 7


@pytest.mark.parametrize("size", [1, 2, 5, 16, 100])
def test_the_middle_of_each_window_is_its_frame(size):
    values = np.random.default_rng(0).normal(size=(30, 3)).astype(np.float32)
    windows = Features(values, 60, "noise").windows(size)
    assert windows.shape == (30, size, 3)
    np.testing.assert_array_equal(windows[:, size // 2], values)


@pytest.mark.parametrize(
    ("values", "rate", "found"),
    [
        (np.zeros((0, 3)), 50, r"shape \(0, 3\)"),
        (np.zeros(3), 50, r"shape \(3,\)"),
        (np.array([[np.nan]]), 50, "with NaN"),
        (np.array([[np.inf]]), 50, "infinity"),
        (np.zeros((3, 3)), 0, "rate 0"),
        (np.zeros((3, 3)), np.nan, "rate nan"),
    ],
)
def test_what_is_no_feature_is_refused(values, rate, found):
    with pytest.raises(InputError, match=found):
        Features(values, rate, "bad")


def test_impossible_requests_are_refused():
    with pytest.raises(InputError, match="allowed: above 0 Hz"):
        ramp(5).resample(-60)
    with pytest.raises(InputError, match="windows of 0"):
        ramp(5).windows(0)
