"""Blinks: a face that never blinks looks dead. They depend on time alone, never on the sound."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.motion.lids import BLINK_S, blink_starts, lid_closure


def blink_curve(frame_count: int, fps: float, per_minute: float) -> NDArray[np.float32]:
    """(frame,) lid closure 0…1; the same for every take of one length and rate."""
    curve = np.zeros(frame_count, np.float32)
    times = np.arange(frame_count) / fps
    for start in blink_starts(frame_count / fps, per_minute):
        first, last = np.searchsorted(times, [start, start + BLINK_S])
        curve[first:last] = lid_closure(times[first:last] - start)
    return curve
