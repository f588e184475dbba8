"""The course of one blink, and when people blink.

A face that never blinks looks dead. Blinks depend on time alone, never on the sound.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from elocute.numerics.smoothing import smoothstep

CLOSING_S = 0.09
CLOSED_S = 0.04
OPENING_S = 0.17
BLINK_S = CLOSING_S + CLOSED_S + OPENING_S
SEED = 20190616


def lid_closure(since_start_s: NDArray[np.float64]) -> NDArray[np.float32]:
    """(moment,) lid closure 0…1 of a blink that starts at zero."""
    closing = np.clip(since_start_s / CLOSING_S, 0, 1)
    opening = np.clip((since_start_s - CLOSING_S - CLOSED_S) / OPENING_S, 0, 1)
    return (smoothstep(closing) - smoothstep(opening)).astype(np.float32)


def blink_starts(duration_s: float, per_minute: float, seed: int = SEED) -> NDArray[np.float64]:
    """Seconds at which blinks start; the same for one length, rate and seed.

    Intervals are drawn from a gamma distribution (shape 4: neither clockwork nor bursts); no
    blink starts in the first second or is cut off by the end.
    """
    if per_minute <= 0:
        return np.zeros(0)
    # One draw for all lengths up to a power of two: a live take asks again for every frame.
    minutes = 2 ** max(0, int(np.ceil(np.log2(max(duration_s, 1.0) / 60))))
    starts = _starts(60.0 * minutes, per_minute, seed)
    return starts[starts + BLINK_S < duration_s]


def blink_curve(
    frame_count: int,
    fps: float,
    per_minute: float,
    *,
    first_frame: int = 0,
    total_frames: int | None = None,
) -> NDArray[np.float32]:
    """Lid closure over a stretch of a take, the same for every take of one length and rate.

    Parameters
    ----------
    frame_count : int
        Frames of the stretch.
    fps : float
        Frames per second.
    per_minute : float
        Blinks a minute on average.
    first_frame : int
        Where the stretch begins in the take.
    total_frames : int, optional
        Frames of the take; without it the take ends with the stretch.

    Returns
    -------
    (frame_count,) float32
        0 open to 1 shut.
    """
    total = first_frame + frame_count if total_frames is None else total_frames
    curve = np.zeros(frame_count, np.float32)
    times = np.arange(first_frame, first_frame + frame_count) / fps
    starts = blink_starts(total / fps, per_minute)
    near = slice(*np.searchsorted(starts, [first_frame / fps - BLINK_S, total / fps]))
    for start in starts[near]:
        first, last = np.searchsorted(times, [start, start + BLINK_S])
        curve[first:last] = lid_closure(times[first:last] - start)
    return curve


@lru_cache(16)
def _starts(duration_s: float, per_minute: float, seed: int) -> NDArray[np.float64]:
    starts: list[float] = []
    draw = np.random.default_rng(seed)
    start = 1.0 + draw.gamma(4.0, 0.5)
    while start < duration_s:
        starts.append(start)
        start += BLINK_S + draw.gamma(4.0, 60.0 / per_minute / 4.0)
    return np.array(starts)
