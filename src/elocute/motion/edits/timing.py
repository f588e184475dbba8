"""Shifts a mouth against its sound, retimes a motion, and makes it loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from elocute.errors import MotionError
from elocute.motion.edits.closures import mouth_columns
from elocute.motion.edits.keyframes import read_keyframes
from elocute.motion.edits.windows import mixed
from elocute.motion.motion import Motion, check_motion, read_frames
from elocute.numerics.input_checks import NUMBERS_MAX, real_number
from elocute.numerics.smoothing import smoothstep
from elocute.one_line_repr import brief

OFFSET_MAX_S = 2.0
STRETCH_MAX = 100.0
LOOP_BLEND_S = 0.25


def with_mouth_offset(motion: Motion, offset_s: float) -> Motion:
    """Move the mouth before or after the rest of the face, and its sound.

    Parameters
    ----------
    motion : Motion
        On a head whose shapes have ARKit's names.
    offset_s : float
        Seconds, -2 to 2; positive is later. Whole frames are moved (the nearest number), so that
        every contact stays as it is.

    Returns
    -------
    Motion
        Of the same length; the first or last frame of the mouth holds where nothing follows.

    Raises
    ------
    MotionError
        For another number, or a head without a mouth's shapes.
    """
    check_motion(motion)
    seconds = real_number(offset_s)
    if seconds is None or abs(seconds) > OFFSET_MAX_S:
        raise MotionError.about(
            "mouth offset",
            found=brief(offset_s),
            allowed=f"{-OFFSET_MAX_S:g} to {OFFSET_MAX_S:g} s",
        )
    columns = mouth_columns(motion)
    if not columns:
        raise MotionError.about(
            "mouth offset",
            found=f"head {motion.head.name!r} without shapes of a mouth",
            allowed="a head with ARKit's shapes",
        )
    frames = np.arange(motion.frame_count) - round(seconds * motion.fps)
    frames = np.clip(frames, 0, motion.frame_count - 1)
    weights = motion.weights.copy()
    weights[:, columns] = motion.weights[frames][:, columns]
    return replace(motion, weights=weights)


def retimed(motion: Motion, times_s: Sequence[tuple[float, float]]) -> Motion:
    """Give moments of a motion other times; the sound is not changed.

    Parameters
    ----------
    motion : Motion
        Any.
    times_s : [(old s, new s), …]
        Both rising, two or more; between them time runs evenly. The motion begins at the first
        pair, which is the new time 0, and ends at the last.

    Returns
    -------
    Motion
        At the same frame rate, of another length.

    Raises
    ------
    MotionError
        For times that do not rise, lie outside the motion, or run a hundred times slower or
        faster.
    """
    check_motion(motion)
    old, new = read_keyframes(times_s, "new times")
    new = new[:, 0] if new.shape[1] == 1 else new
    allowed = f"pairs (old s, new s), both rising, old within 0 to {motion.duration_s:g} s"
    if new.ndim != 1 or len(old) < 2 or (np.diff(new) <= 0).any():
        raise MotionError.about("new times", found="pairs that do not rise", allowed=allowed)
    if old[0] < 0 or old[-1] > motion.duration_s + 1 / motion.fps:
        raise MotionError.about("new times", found=f"{old[0]:g} to {old[-1]:g} s", allowed=allowed)
    stretch = np.diff(new) / np.diff(old)
    if stretch.max() > STRETCH_MAX or stretch.min() < 1 / STRETCH_MAX:
        raise MotionError.about(
            "new times",
            found=f"a part {stretch[np.abs(np.log(stretch)).argmax()]:g} times as long",
            allowed=f"{1 / STRETCH_MAX:g} to {STRETCH_MAX:g} times",
        )
    count = max(1, round((new[-1] - new[0]) * motion.fps))
    if count * len(motion.names) > NUMBERS_MAX:
        most = NUMBERS_MAX // max(1, len(motion.names))
        raise MotionError.about("new times", found=f"{count} frames", allowed=f"up to {most}")
    places = np.interp(np.arange(count) / motion.fps + new[0], new, old) * motion.fps
    return read_frames(motion, places, motion.fps)


def looped(motion: Motion, *, blend_s: float = LOOP_BLEND_S) -> Motion:
    """Let a motion end as it begins, so that it can be repeated.

    Parameters
    ----------
    motion : Motion
        Any.
    blend_s : float
        How long it leaves the first frame at the beginning, and comes back to it at the end, s.

    Returns
    -------
    Motion
        Of the same length; the first and the last two frames are the first frame, so that value
        and speed (zero) agree. Every frame lies between what it was and the first frame, so lips
        that are sealed stay sealed where they are in the first.

    Raises
    ------
    MotionError
        For a motion shorter than both blends, or a blend outside 0.02 to 10 s.
    """
    check_motion(motion)
    length = real_number(blend_s)
    if length is None or not 0.02 <= length <= 10:
        raise MotionError.about("loop", found=f"blend {brief(blend_s)}", allowed="0.02 to 10 s")
    frames = round(length * motion.fps)
    if 2 * (frames + 2) > motion.frame_count:
        raise MotionError.about(
            "loop",
            found=f"{motion.duration_s:g} s for a blend of {length:g} s",
            allowed="a motion longer than two blends",
        )
    number = np.arange(motion.frame_count)
    away = np.minimum(number, number[::-1])  # frames to the nearer end
    share = smoothstep(np.clip((away - 1) / max(1, frames), 0, 1))
    first = read_frames(motion, np.zeros(motion.frame_count), motion.fps)
    return mixed(first, motion, np.asarray(share, np.float64))
