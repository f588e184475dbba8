"""Frame rates as people write them."""

import pytest

from elocute.errors import InputError
from elocute.numerics.frame_rates import frame_rate


@pytest.mark.parametrize(
    ("written", "rate"),
    [
        ("30000/1001", 30000 / 1001),
        ("29.97", 30000 / 1001),
        (29.97, 30000 / 1001),
        (29.97002997, 30000 / 1001),
        ("23.976", 24000 / 1001),
        ("23.98", 24000 / 1001),
        ("59.94", 60000 / 1001),
        ("119.88", 120000 / 1001),
        ("25", 25.0),
        (24, 24.0),
        ("60/1", 60.0),
        ("12.5", 12.5),
    ],
)
def test_what_is_written_is_meant_exactly(written, rate):
    assert frame_rate(written) == rate


@pytest.mark.parametrize("written", ["", "fast", "30/0", "1/2/3", "30000 1001"])
def test_what_is_none(written):
    with pytest.raises(InputError, match=r"a number or a fraction \(30000/1001\)"):
        frame_rate(written)


def test_an_hour_does_not_drift():
    """The frame that is shown at an hour, by the exact rate and by ours."""
    assert abs(3600 * 30000 / 1001 - 3600 * frame_rate("29.97")) < 1e-9
    assert 3600 * 30000 / 1001 - 3600 * 29.97 > 0.1  # what it was
