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


def linear(
    times: NDArray[np.float64], values: NDArray[np.float64], at: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(moment, value): straight lines between keyframes."""
    return np.stack([np.interp(at, times, column) for column in values.T], axis=1)


def smooth(
    times: NDArray[np.float64], values: NDArray[np.float64], at: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(moment, value): cubics that neither jerk nor overshoot, at rest at both ends.

    Slopes are the weighted harmonic means of Fritsch and Butland (1984): zero where a value
    turns back, so nothing swings past a keyframe, and no stop on the way to a further one.
    """
    if len(times) == 1:
        return np.repeat(values, len(at), axis=0)
    slopes = _slopes(times, values)
    at = np.clip(at, times[0], times[-1])
    below = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    width = np.diff(times)[below][:, None]
    share = ((at - times[below])[:, None]) / width
    rest = 1 - share
    # The cubic Hermite polynomials.
    return (
        values[below] * rest**2 * (1 + 2 * share)
        + values[below + 1] * share**2 * (3 - 2 * share)
        + width * share * rest * (slopes[below] * rest - slopes[below + 1] * share)
    )


def _slopes(times: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    widths = np.diff(times)[:, None]
    steps = np.diff(values, axis=0) / widths
    slopes = np.zeros_like(values)
    before, after = steps[:-1], steps[1:]
    onwards = before * after > 0
    w1, w2 = 2 * widths[1:] + widths[:-1], widths[1:] + 2 * widths[:-1]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        mean = (w1 + w2) / (w1 / before + w2 / after)
    slopes[1:-1] = np.where(onwards, mean, 0.0)
    return slopes
