"""Blinks: a face that never blinks looks dead. They depend on time alone, never on the sound."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.motion.blink_timing import BLINK_S, blink_starts, lid_closure


def blink_curve(
    frame_count: int,
    fps: float,
    per_minute: float,
    *,
    first_frame: int = 0,
    total_frames: int | None = None,
) -> NDArray[np.float32]:
    """(frame_count,) lid closure 0…1 from `first_frame` on of a take of `total_frames`.

    The same for every take of one length and rate. Without `total_frames` the take ends here.
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
