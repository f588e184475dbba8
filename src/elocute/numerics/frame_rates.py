"""Frame rates as people write them: 25, 29.97, 30000/1001."""

from __future__ import annotations

from elocute.errors import InputError
from elocute.one_line_repr import brief

BROADCAST = (12, 15, 24, 30, 48, 60, 90, 96, 100, 120, 240)
ROUNDED = 0.006
"""What two decimals leave of a rate."""


def frame_rate(value: float | str) -> float:
    """A frame rate, exactly: 29.97 is 30000/1001, as in film and television.

    A number, or a fraction such as "30000/1001"; InputError for a text that is neither.
    """
    if isinstance(value, str):
        above, stroke, below = value.partition("/")
        try:
            value = float(above) / (float(below) if stroke else 1.0)
        except (ValueError, ZeroDivisionError):
            raise InputError.about(
                "frame rate", found=brief(value), allowed="a number or a fraction (30000/1001)"
            ) from None
    if not isinstance(value, int | float):
        return value
    exact = (whole * 1000 / 1001 for whole in BROADCAST)
    return next((each for each in exact if abs(value - each) < ROUNDED), float(value))
