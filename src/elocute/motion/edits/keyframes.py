"""Keyframes: values at given times, and interpolation between them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elocute.errors import MotionError
from elocute.numerics.input_checks import floats_of
from elocute.numerics.monotone_cubic import monotone_cubic
from elocute.numerics.resampling import interpolate
from elocute.one_line_repr import brief

KEYS_MAX = 1_000_000
LARGEST = 1e6
"""Of times in seconds, degrees and weights: eleven days, and far beyond any face."""
WAYS = ("smooth", "linear")
Keyframes = Sequence[tuple[float, ArrayLike]]
"""(time s, value or values) each, times rising. Before the first and after the last they hold."""


def as_keyframes(given: Keyframes | ArrayLike) -> Keyframes:
    """Keyframes as they are; a number, or a flat row of numbers, holds for the whole motion."""
    if isinstance(given, Real):
        return [(0.0, given)]  # pyright: ignore[reportReturnType]
    row = _listed(given, "keyframes")
    if row and all(isinstance(part, Real) for part in row):
        return [(0.0, given)]  # pyright: ignore[reportReturnType]
    return row  # pyright: ignore[reportReturnType]


def read_keyframes(
    keyframes: Keyframes, what: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (key,) s and values (key, value). Raises MotionError for anything malformed."""
    allowed = "(seconds, value) each, values of one length"
    try:
        pairs = [(time, value) for time, value in _listed(keyframes, what)]
    except (TypeError, ValueError):
        raise MotionError.about(what, found="no keyframes", allowed=allowed) from None
    times = _numbers([time for time, _ in pairs], what, allowed)
    rows = [np.atleast_1d(_numbers(value, what, allowed)) for _, value in pairs]
    if times.ndim != 1 or len({row.shape for row in rows}) > 1:
        raise MotionError.about(what, found="no keyframes", allowed=allowed)
    values = np.array(rows)
    if not len(times) or values.ndim != 2:
        raise MotionError.about(what, found="no keyframe", allowed="one (seconds, value) or more")
    if not (np.isfinite(times).all() and np.isfinite(values).all()):
        raise MotionError.about(what, found="a keyframe that is not finite")
    if max(np.abs(times).max(), np.abs(values).max(initial=0)) > LARGEST:
        largest = max(np.abs(times).max(), np.abs(values).max(initial=0))
        raise MotionError.about(
            what, found=f"{largest:g} in a keyframe", allowed=f"up to {LARGEST:g}"
        )
    if (np.diff(times) <= 0).any():
        place = int(np.argmax(np.diff(times) <= 0))
        raise MotionError.about(
            what, found=f"{times[place + 1]:g} s after {times[place]:g} s", allowed="rising times"
        )
    return times, values


def _listed(rows: Any, what: str) -> list[Any]:
    """The keyframes as a list. Raises MotionError for none or too many."""
    try:
        parts = None if isinstance(rows, str | bytes) else iter(rows)
    except TypeError:
        parts = None
    listed = [] if parts is None else list(itertools.islice(parts, KEYS_MAX + 1))
    if parts is None or len(listed) > KEYS_MAX:
        raise MotionError.about(
            what,
            found=brief(rows) if parts is None else f"more than {KEYS_MAX} keyframes",
            allowed=f"numbers, or up to {KEYS_MAX} keyframes (seconds, value)",
        )
    return listed


def _numbers(values: Any, what: str, allowed: str) -> NDArray[np.float64]:
    return floats_of(
        values, what, error=MotionError, allowed=allowed, most=KEYS_MAX, dtype=np.float64
    )


def between_keys(
    times: NDArray[np.float64], values: NDArray[np.float64], at: NDArray[np.float64], way: str
) -> NDArray[np.float64]:
    """(moment, value) between keyframes: "smooth", cubics without overshoot, or "linear".

    Raises MotionError.
    """
    if way not in WAYS:
        raise MotionError.about("between keyframes", found=brief(way), allowed=", ".join(WAYS))
    return (monotone_cubic if way == "smooth" else interpolate)(times, values, at)
