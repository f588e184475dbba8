"""Blinks: a face that never blinks looks dead. They depend on time alone, never on the sound."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

CLOSING_S = 0.09
CLOSED_S = 0.04
OPENING_S = 0.17
SEED = 20190616


def blink_curve(frame_count: int, fps: float, per_minute: float) -> NDArray[np.float32]:
    """(frame,) lid closure 0…1; the same for every take of one length and rate.

    Intervals are drawn from a gamma distribution (shape 4: neither clockwork nor bursts); no
    blink starts in the first second or is cut off by the end.
    """
    curve = np.zeros(frame_count, np.float32)
    if per_minute <= 0:
        return curve
    times = np.arange(frame_count) / fps
    draw = np.random.default_rng(SEED)
    whole = CLOSING_S + CLOSED_S + OPENING_S
    start = 1.0 + draw.gamma(4.0, 0.5)
    while start + whole < frame_count / fps:
        first, last = np.searchsorted(times, [start, start + whole])
        curve[first:last] = _lid(times[first:last] - start)
        start += whole + draw.gamma(4.0, 60.0 / per_minute / 4.0)
    return curve


def _lid(since_start_s: NDArray[np.float64]) -> NDArray[np.float32]:
    closing = np.clip(since_start_s / CLOSING_S, 0, 1)
    opening = np.clip((since_start_s - CLOSING_S - CLOSED_S) / OPENING_S, 0, 1)
    return (_smooth(closing) - _smooth(opening)).astype(np.float32)


def _smooth(share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Smoothstep: starts and ends without a jerk."""
    return share * share * (3 - 2 * share)
