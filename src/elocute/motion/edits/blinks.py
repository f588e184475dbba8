"""Blinks put into a motion or taken out of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from elocute.errors import MotionError
from elocute.motion.blink_timing import (
    BLINK_S,
    CLOSED_S,
    CLOSING_S,
    SEED,
    blink_starts,
    lid_closure,
)
from elocute.motion.edits.lid_gap import lid_scale
from elocute.motion.edits.shape import shape_index
from elocute.motion.motion import Motion, check_motion
from elocute.numerics.given import floats_of, real_number, whole_number
from elocute.one_line_repr import brief

SIDES = ("Left", "Right")
PER_MINUTE_MAX = 120.0
BLINKS_MAX = 1_000_000
SHUT_S = CLOSING_S + CLOSED_S / 2  # from a blink's start to the middle of its shut lids


def with_blinks(
    motion: Motion,
    times_s: Sequence[float] = (),
    *,
    per_minute: float = 0.0,
    seed: int = SEED,
    replace: bool = False,
) -> Motion:
    """Blink at moments given, or now and then, or both.

    times_s     when the lids are shut, seconds; each is moved to the nearest frame, so that the
                lids are seen shut at any frame rate and in any clip, be it one frame long
    per_minute  further blinks, drawn from `seed`: none in the first second, none cut by the end
    replace     take the blinks away that are there; without any new ones, nobody blinks

    A blink keeps its course where the clip's end cuts it, so nothing jumps. Where blinks meet,
    the further closed lid wins. Lids shut on every face: where the face changes over time,
    weights follow its eyes. Raises MotionError for a head without eyeBlinkLeft and
    eyeBlinkRight and for moments outside the motion.
    """
    check_motion(motion)
    columns = [shape_index(motion, f"eyeBlink{side}") for side in SIDES]
    closure = _closure(motion, _moments(motion, times_s, per_minute, seed))
    weights = motion.weights.copy()
    for side, column in zip(SIDES, columns, strict=True):
        drawn = closure * lid_scale(motion, side.lower())
        weights[:, column] = drawn if replace else np.maximum(weights[:, column], drawn)
    return dataclasses.replace(motion, weights=weights)


def _moments(
    motion: Motion, times_s: Sequence[float], per_minute: float, seed: int
) -> NDArray[np.float64]:
    allowed = f"seconds, 0 to {motion.duration_s:g}"
    given = floats_of(
        times_s,
        "blinks",
        error=MotionError,
        allowed=allowed,
        most=BLINKS_MAX,
        dtype=np.float64,
    )
    wrong = ~((given >= 0) & (given <= motion.duration_s))  # also true for NaN
    if given.ndim != 1 or len(given) > BLINKS_MAX or wrong.any():
        raise MotionError.about(
            "blinks",
            found=f"a blink at {given[wrong][0]:g} s" if wrong.any() else "no list",
            allowed=f"0 to {motion.duration_s:g} s",
        )
    often = real_number(per_minute)
    if often is None or not 0 <= often <= PER_MINUTE_MAX:
        raise MotionError.about(
            "blinks", found=f"{brief(per_minute)} a minute", allowed=f"0 to {PER_MINUTE_MAX:g}"
        )
    if often * motion.duration_s / 60 > BLINKS_MAX:
        raise MotionError.about(
            "blinks", found=f"{often:g} a minute", allowed=f"up to {BLINKS_MAX} in one motion"
        )
    drawn_from = whole_number(seed)
    if drawn_from is None or drawn_from < 0:
        raise MotionError.about("blinks", found=f"seed {brief(seed)}", allowed="a whole number")
    drawn = blink_starts(motion.duration_s, often, seed) + SHUT_S
    return np.concatenate([given, drawn])


def _closure(motion: Motion, moments_s: NDArray[np.float64]) -> NDArray[np.float32]:
    """(frame,) 0…1; only the frames around each blink are looked at."""
    closure = np.zeros(motion.frame_count, np.float32)
    times = motion.times_s
    reach = int(np.ceil(BLINK_S * motion.fps)) + 1
    for moment in moments_s:
        frame = min(round(moment * motion.fps), motion.frame_count - 1)
        part = slice(max(0, frame - reach), frame + reach)
        lid = lid_closure(times[part] - times[frame] + SHUT_S)
        closure[part] = np.maximum(closure[part], lid)
    return closure
