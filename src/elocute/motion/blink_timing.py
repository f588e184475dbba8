"""The course of one blink, and blinks at random times.

Lids fall fast and rise more slowly, ever more slowly towards the end; half shut they stay for about
0.12 s, as those of tracked talkers do (docs/measurements/life.md).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.numerics.smoothing import smoothstep

CLOSING_S = 0.07
CLOSED_S = 0.03
OPENING_S = 0.19
BLINK_S = CLOSING_S + CLOSED_S + OPENING_S
SEED = 20190616


def lid_closure(since_start_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """(moment,) lid closure 0…1 of a blink that starts at zero."""
    closing = np.clip(since_start_s / CLOSING_S, 0, 1)
    opening = np.clip((since_start_s - CLOSING_S - CLOSED_S) / OPENING_S, 0, 1)
    return smoothstep(closing) - smoothstep(1 - np.square(1 - opening))


def blink_starts(duration_s: float, per_minute: float, seed: int = SEED) -> NDArray[np.float64]:
    """Seconds at which blinks start; the same for one length, rate and seed.

    Intervals are drawn from a gamma distribution (shape 4: neither clockwork nor bursts); no
    blink starts in the first second or is cut off by the end.
    """
    if per_minute <= 0:
        return np.zeros(0)
    draw = np.random.default_rng(seed)
    starts, start = [], 1.0 + draw.gamma(4.0, 0.5)
    while start + BLINK_S < duration_s:
        starts.append(start)
        start += BLINK_S + draw.gamma(4.0, 60.0 / per_minute / 4.0)
    return np.array(starts)
