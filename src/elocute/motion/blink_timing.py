"""One blink over time, and when people blink."""

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


@lru_cache(16)
def _starts(duration_s: float, per_minute: float, seed: int) -> NDArray[np.float64]:
    starts: list[float] = []
    draw = np.random.default_rng(seed)
    start = 1.0 + draw.gamma(4.0, 0.5)
    while start < duration_s:
        starts.append(start)
        start += BLINK_S + draw.gamma(4.0, 60.0 / per_minute / 4.0)
    return np.array(starts)
