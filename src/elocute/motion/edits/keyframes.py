"""Keyframes: values at a few moments, and what lies between them."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elocute.errors import MotionError

Keyframes = Sequence[tuple[float, ArrayLike]]
"""(time s, value or values) each, times rising. Before the first and after the last they hold."""


def as_keyframes(given: Keyframes | ArrayLike) -> Keyframes:
    """Keyframes as they are; a number, or a flat row of numbers, holds for the whole motion."""
    row: Sequence[object] = [given] if isinstance(given, Real) else list(given)  # pyright: ignore
    if row and all(isinstance(part, Real) for part in row):
        return [(0.0, given)]  # pyright: ignore[reportReturnType]
    return given  # pyright: ignore[reportReturnType]


def read_keyframes(
    keyframes: Keyframes, what: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (key,) s and values (key, value). Raises MotionError for anything malformed."""
    try:
        times = np.array([time for time, _ in keyframes], np.float64)
        values = np.array([np.atleast_1d(value) for _, value in keyframes], np.float64)
    except (TypeError, ValueError) as error:
        raise MotionError.about(
            what, found="no keyframes", allowed="(seconds, value) each, values of one length"
        ) from error
    if not len(times) or values.ndim != 2:
        raise MotionError.about(what, found="no keyframe", allowed="one (seconds, value) or more")
    if not (np.isfinite(times).all() and np.isfinite(values).all()):
        raise MotionError.about(what, found="a keyframe that is not finite")
    if (np.diff(times) <= 0).any():
        place = int(np.argmax(np.diff(times) <= 0))
        raise MotionError.about(
            what, found=f"{times[place + 1]:g} s after {times[place]:g} s", allowed="rising times"
        )
    return times, values
