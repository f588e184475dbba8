"""A part of a motion."""

from __future__ import annotations

import math
from dataclasses import replace

from elocute.errors import MotionError
from elocute.motion.motion import Motion


def cut(motion: Motion, start_s: float = 0.0, stop_s: float | None = None) -> Motion:
    """The frames from `start_s` up to, not including, `stop_s` (the end where None).

    Raises MotionError where no frame is left or a bound lies outside the motion.
    """
    stop_s = motion.duration_s if stop_s is None else stop_s
    if not (math.isfinite(start_s) and math.isfinite(stop_s) and 0 <= start_s < stop_s):
        raise MotionError.about(
            "cut", found=f"{start_s:g} to {stop_s:g} s", allowed="from 0 s, rising"
        )
    # A thousandth of a frame forgives times that were rounded to decimals.
    first = math.ceil(start_s * motion.fps - 1e-3)
    last = min(motion.frame_count, math.ceil(stop_s * motion.fps - 1e-3))
    if first >= last:
        raise MotionError.about(
            "cut",
            found=f"no frame from {start_s:g} to {stop_s:g} s",
            allowed=f"a part of 0 to {motion.duration_s:g} s",
        )
    rotations = motion.rotations
    return replace(
        motion,
        weights=motion.weights[first:last],
        rotations=None if rotations is None else rotations[first:last],
    )
