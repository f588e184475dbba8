"""Adds blinks to a motion, removes them, and measures how far eyes stand open.

A blink has to reach across the eye, also while the face changes.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from elocute.errors import MotionError
from elocute.head.shape_reach import has_lids, lid_gap
from elocute.motion.blink_timing import (
    BLINK_S,
    CLOSED_S,
    CLOSING_S,
    SEED,
    blink_starts,
    lid_closure,
)
from elocute.motion.edits.shape import shape_index
from elocute.motion.motion import Motion, check_motion
from elocute.numerics.input_checks import floats_of, real_number, whole_number
from elocute.one_line_repr import brief

IDENTITY_NAME = re.compile(r"identity(\d{3})")
SIDES = ("Left", "Right")
PER_MINUTE_MAX = 120.0
BLINKS_MAX = 1_000_000
FALLING = 0.03  # weight above its usual one from which on a lid blinks
NEAR_S = 0.15
SHUT_S = CLOSING_S + CLOSED_S / 2  # from a blink's start to the middle of its shut lids


def with_blinks(
    motion: Motion,
    times_s: Sequence[float] = (),
    *,
    per_minute: float = 0.0,
    seed: int = SEED,
    replace: bool = False,
) -> Motion:
    """Blink at given moments, at random ones, or both.

    A blink keeps its course where the end of the clip cuts it, so nothing jumps. Where blinks
    overlap, the lid that is closed further wins. Lids shut on every face: where the face changes
    over time, weights follow its eyes.

    Parameters
    ----------
    motion : Motion
        On a head with the shapes eyeBlinkLeft and eyeBlinkRight.
    times_s : sequence of float
        When the lids are shut, s; each is moved to the nearest frame, so that the lids are seen
        shut at any frame rate and in any clip, even one frame long.
    per_minute : float
        Further blinks at random, 0 to 120 a minute: none in the first second, none cut by the end.
    seed : int
        For these.
    replace : bool
        Remove the blinks that are there; without any new ones, nobody blinks.

    Returns
    -------
    Motion

    Raises
    ------
    MotionError
        For a head without these shapes, and for moments outside the motion.
    """
    check_motion(motion)
    columns = [shape_index(motion, f"eyeBlink{side}") for side in SIDES]
    closure = _closure(motion, _moments(motion, times_s, per_minute, seed))
    weights = motion.weights.copy()
    for side, column in zip(SIDES, columns, strict=True):
        drawn = closure * lid_scale(motion, side.lower())
        weights[:, column] = drawn if replace else np.maximum(weights[:, column], drawn)
    return dataclasses.replace(motion, weights=weights)


def without_blinks(motion: Motion, times_s: Sequence[float] | None = None) -> Motion:
    """Take blinks out; lids that hang lower all the time, as of a sad face, stay as they are.

    Parameters
    ----------
    motion : Motion
        On a head with the shapes eyeBlinkLeft and eyeBlinkRight.
    times_s : sequence of float, optional
        Moments in or within 0.15 s of the blinks, s; None for all blinks.

    Returns
    -------
    Motion

    Raises
    ------
    MotionError
        For a head without these shapes, and a moment without a blink.
    """
    check_motion(motion)
    columns = [shape_index(motion, f"eyeBlink{side}") for side in SIDES]
    lids = motion.weights[:, columns].copy()
    held = np.median(lids, axis=0)
    taken = np.ones(motion.frame_count, bool)
    if times_s is not None:
        allowed = f"seconds, 0 to {motion.duration_s:g}"
        given = floats_of(times_s, "blinks", error=MotionError, allowed=allowed, most=BLINKS_MAX)
        taken = _blinks_at((lids - held).max(axis=1), given, motion.fps)
    weights = motion.weights.copy()
    weights[:, columns] = np.where(taken[:, None], np.minimum(lids, held), lids)
    return dataclasses.replace(motion, weights=weights)


def _blinks_at(
    closure: NDArray[np.floating], times_s: NDArray[np.floating], fps: float
) -> NDArray[np.bool_]:
    """(frame,) the blinks that are nearest to these moments. Raises MotionError."""
    shut = np.flatnonzero(closure > FALLING)
    lower = closure > 1e-4
    edges = np.flatnonzero(np.diff(np.concatenate([[0], lower.astype(np.int8), [0]])))
    taken = np.zeros(len(closure), bool)
    for time in times_s:
        nearest = int(shut[np.abs(shut - time * fps).argmin()]) if len(shut) else -1
        if nearest < 0 or abs(nearest / fps - time) > NEAR_S:
            runs = [(a, b) for a, b in edges.reshape(-1, 2) if closure[a:b].max() > FALLING]
            known = ", ".join(f"{(a + b - 1) / 2 / fps:.2f}" for a, b in runs[:20])
            raise MotionError.about(
                "blinks",
                found=f"none at {time:g} s",
                allowed=f"within {NEAR_S:g} s of: {known}" if known else "none: nobody blinks",
            )
        place = int(np.searchsorted(edges, nearest, side="right"))
        taken[edges[place - 1] : edges[place]] = True
    return taken


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
            found=f"a blink at {given[wrong][0]:g} s" if wrong.any() else "not a list of seconds",
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


def identity_columns(motion: Motion) -> list[int]:
    """Columns of the components that change the face itself: identity000, identity001, …"""
    return [i for i, name in enumerate(motion.names) if IDENTITY_NAME.fullmatch(name)]


def lid_scale(motion: Motion, side: str) -> NDArray[np.float32]:
    """(frame,) how much further a lid travels than on the head's template; one for most motions.

    A blink shape fits the eye of the template. Where identity components open it wider, a
    shut lid needs a weight above one, in proportion.
    """
    columns = identity_columns(motion)
    head = motion.head
    if not columns or not has_lids(head, side):
        return np.ones(motion.frame_count, np.float32)
    rest = lid_gap(head, head.template, side)
    slopes = np.array([lid_gap(head, head.expression_basis[c], side) for c in columns])
    return (1 + motion.weights[:, columns] @ slopes / rest).astype(np.float32)
