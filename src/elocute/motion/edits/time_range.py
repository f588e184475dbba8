"""Cut a motion to a range of time."""

from __future__ import annotations

import math
from dataclasses import replace

from elocute.errors import MotionError
from elocute.motion.motion import Motion, check_motion
from elocute.numerics.input_checks import real_number
from elocute.one_line_repr import brief


def cut(motion: Motion, start_s: float = 0.0, stop_s: float | None = None) -> Motion:
    """A part of a motion.

    Parameters
    ----------
    motion : Motion
        The whole.
    start_s, stop_s : float
        The frames from `start_s` up to, not including, `stop_s`, s; None for the end.

    Returns
    -------
    Motion

    Raises
    ------
    MotionError
        Where no frame is left, or the times are not rising from 0.
    """
    check_motion(motion)
    stop_s = motion.duration_s if stop_s is None else stop_s
    start, stop = real_number(start_s), real_number(stop_s)
    if start is None or stop is None or not 0 <= start < stop:
        raise MotionError.about(
            "cut", found=f"{brief(start_s)} to {brief(stop_s)} s", allowed="from 0 s, rising"
        )
    start_s, stop_s = start, min(stop, motion.duration_s)
    # A thousandth of a frame forgives times that were rounded to decimals.
    first = math.ceil(min(start_s, motion.duration_s) * motion.fps - 1e-3)
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
