"""An edit list applied to a motion, kind after kind in one order.

Times of all edits are those of the sound; only what comes last, `retime`, gives other times.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError, MotionError
from elocute.head.identity import resolve_identity
from elocute.motion.edits.amplitude import with_amplitude
from elocute.motion.edits.blinks import with_blinks, without_blinks
from elocute.motion.edits.closures import closed_by, keep_contacts
from elocute.motion.edits.edit_items import (
    AmplitudeItem,
    BlinksItem,
    ClosedItem,
    CurveItem,
    FaceItem,
    GazeItem,
    HeadItem,
    Item,
    Keys,
    LoopItem,
    Moment,
    MoodItem,
    OffsetItem,
    RetimeItem,
    Span,
    StyleItem,
)
from elocute.motion.edits.edit_list import EditList, edits_of
from elocute.motion.edits.gaze import with_gaze
from elocute.motion.edits.identity import with_identity_over_time
from elocute.motion.edits.pose import with_pose
from elocute.motion.edits.shape import with_shape
from elocute.motion.edits.timing import looped, retimed, with_mouth_offset
from elocute.motion.edits.windows import mixed, window
from elocute.motion.motion import Motion, check_motion
from elocute.numerics.quaternions import no_turn

NECK_SHARE = 0.4
"""Of a turn of the head, as in its life; the rest is the head's joint's."""


def with_edits(motion: Motion, edits: EditList | str | Path | Mapping[str, Any]) -> Motion:
    """Apply an edit list to a motion.

    Parameters
    ----------
    motion : Motion
        As a model made it, or stored.
    edits : EditList, str, Path or mapping
        An edit list, its file, or what such a file holds. Kinds are applied in this order: offset,
        amplitude, curve, closed, head, gaze, blinks, face, retime, loop; those of one kind in the
        order of the list.

    Returns
    -------
    Motion

    Raises
    ------
    MotionError
        For a malformed list, for style and mood, which are made with the speech, and for an edit
        that does not fit the motion.
    """
    check_motion(motion)
    chosen = edits_of(edits)
    for place, item in enumerate(chosen.items):
        if isinstance(item, StyleItem | MoodItem):
            kind = "style" if isinstance(item, StyleItem) else "mood"
            raise MotionError.about(
                f"{chosen.source}: edits[{place}]",
                found=f"a {kind} for a motion that is made already",
                allowed="any other edit",
                remedy="give the edits to `animate` with the speech, where it is made",
            )
    return shaped(motion, chosen)


def shaped(motion: Motion, edits: EditList) -> Motion:
    """Apply all edits but style and mood. Raises MotionError, naming the edit."""
    duration_s = motion.duration_s
    for kind, apply in _ORDER.items():
        for place, item in enumerate(edits.items):
            if type(item) is kind:
                try:
                    motion = apply(motion, item, duration_s)
                except InputError as error:
                    raise MotionError(f"{edits.source}: edits[{place}]: {error}") from None
    return motion


def share_of(span: Span, times_s: NDArray[np.float64], duration_s: float) -> NDArray[np.float64]:
    """(frame,) how much of an edit holds at these times. Raises MotionError."""
    return window(times_s, *_ends(span, duration_s), span.blend_s)


def _ends(span: Span, duration_s: float) -> tuple[float | None, float | None]:
    start, stop = (
        None if end is None else _seconds(end, duration_s) for end in (span.start, span.stop)
    )
    if (start or 0.0) >= (duration_s if stop is None else stop):
        raise MotionError.about(
            "times",
            found=f"from {start or 0.0:g} to {duration_s if stop is None else stop:g} s",
            allowed=f"rising, 0 to {duration_s:g} s",
        )
    return start, stop


def _seconds(moment: Moment, duration_s: float) -> float:
    """A moment of a motion of this length, which may be rounded to a hundredth of a second."""
    seconds = moment.at(duration_s)
    if not -1e-9 <= seconds <= duration_s + 0.01:
        raise MotionError.about("time", found=f"{seconds:g} s", allowed=f"0 to {duration_s:g} s")
    return min(max(seconds, 0.0), duration_s)


def _keys(keys: Keys, duration_s: float) -> list[tuple[float, tuple[float, ...]]]:
    return [(_seconds(moment, duration_s), values) for moment, values in keys]


def _within(before: Motion, after: Motion, span: Span, duration_s: float) -> Motion:
    if span.start is None and span.stop is None:
        return after
    return mixed(before, after, share_of(span, before.times_s, duration_s))


def _offset(motion: Motion, item: OffsetItem, _duration_s: float) -> Motion:
    return with_mouth_offset(motion, item.seconds)


def _amplitude(motion: Motion, item: AmplitudeItem, duration_s: float) -> Motion:
    share = share_of(item.span, motion.times_s, duration_s)
    return with_amplitude(motion, item.regions, share=share)


def _curve(motion: Motion, item: CurveItem, duration_s: float) -> Motion:
    keys = _keys(item.keys, duration_s)
    edited = with_shape(motion, item.curve, keys, add=item.mode == "add", between=item.between)
    if item.mode == "add":  # two halves of a smile are one smile
        before = motion.weights
        within = np.clip(edited.weights, np.minimum(0, before), np.maximum(1, before))
        edited = replace(edited, weights=within)
    edited = _within(motion, edited, item.span, duration_s)
    mouth = item.curve.startswith(("jaw", "mouth", "tongue"))
    return keep_contacts(motion, edited) if mouth and item.contacts == "keep" else edited


def _closed(motion: Motion, item: ClosedItem, duration_s: float) -> Motion:
    ends = _ends(item.span, duration_s)
    return closed_by(motion, window(motion.times_s, *ends, item.span.blend_s, around=True))


def _head(motion: Motion, item: HeadItem, duration_s: float) -> Motion:
    joints = [name for name in ("neck", "head") if name in motion.head.joint_names]
    if not joints:
        raise MotionError.about(
            "head keys",
            found=f"head {motion.head.name!r} without a joint of the neck or head",
            allowed="a head with joints",
        )
    edited = motion
    if item.mode == "replace" and motion.rotations is not None:
        turns = motion.rotations.copy()
        places = [motion.head.joint_names.index(name) for name in joints]
        turns[:, places] = no_turn(motion.frame_count, len(places))
        edited = replace(motion, rotations=turns)
    shares = (NECK_SHARE, 1 - NECK_SHARE) if len(joints) == 2 else (1.0,)
    for joint, share in zip(joints, shares, strict=True):
        keys = [(when, np.multiply(share, v)) for when, v in _keys(item.keys, duration_s)]
        edited = with_pose(edited, joint, keys, between=item.between)
    return _within(motion, edited, item.span, duration_s)


def _gaze(motion: Motion, item: GazeItem, duration_s: float) -> Motion:
    edited = with_gaze(motion, _keys(item.keys, duration_s), between=item.between)
    return _within(motion, edited, item.span, duration_s)


def _blinks(motion: Motion, item: BlinksItem, duration_s: float) -> Motion:
    def seconds(moments: Sequence[Moment]) -> list[float]:
        return [_seconds(moment, duration_s) for moment in moments]

    if item.remove is None:
        motion = without_blinks(motion)
    elif item.remove:
        motion = without_blinks(motion, seconds(item.remove))
    return with_blinks(motion, seconds(item.add), per_minute=item.per_minute, seed=item.seed)


def _face(motion: Motion, item: FaceItem, duration_s: float) -> Motion:
    keys = [(_seconds(moment, duration_s), resolve_identity(name)) for moment, name in item.keys]
    return with_identity_over_time(motion, keys)


def _retime(motion: Motion, item: RetimeItem, duration_s: float) -> Motion:
    return retimed(motion, [(_seconds(old, duration_s), new) for old, new in item.times])


def _loop(motion: Motion, item: LoopItem, _duration_s: float) -> Motion:
    return looped(motion, blend_s=item.blend_s)


_ORDER: dict[type[Item], Callable[[Motion, Any, float], Motion]] = {
    OffsetItem: _offset,
    AmplitudeItem: _amplitude,
    CurveItem: _curve,
    ClosedItem: _closed,
    HeadItem: _head,
    GazeItem: _gaze,
    BlinksItem: _blinks,
    FaceItem: _face,
    RetimeItem: _retime,
    LoopItem: _loop,
}
