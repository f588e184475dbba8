"""Pose: head, neck, jaw and eyes turned over time (VOCA 2019, section 4 and Figure 7)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elocute.errors import MotionError
from elocute.motion.edits.joints import joint_index
from elocute.motion.edits.keyframes import Keyframes, as_keyframes, read_keyframes, smooth
from elocute.motion.motion import Motion, check_motion
from elocute.numerics.quaternions import from_axis_angle, multiply, no_turn


def with_pose(
    motion: Motion,
    joint: str,
    rotations: Keyframes | ArrayLike,
    *,
    degrees: bool = True,
) -> Motion:
    """Turn a joint, after whatever it did already.

    joint      as the head names it: neck, head, jaw, eyeLeft, eyeRight
    rotations  one axis-angle vector (x, y, z) for the whole motion, or keyframes
               [(time s, (x, y, z)), …]. Its direction is the axis, its length the angle: about
               one axis it is just the angle. +x nods (chin down), +y turns to the head's own
               left, +z tilts to its own right. Between keyframes each component follows a
               cubic without overshoot; outside them it holds
    degrees    False: radians

    The new rotation comes after the joint's old one, in its parent's frame, so the opposite
    angles take it back. It turns what the shapes have made: the shape `jawOpen` is the jaw
    joint's opening already (20 degrees at weight one on the built-in head), so a jaw pose opens
    the mouth further by its own angle and leaves the weight of `jawOpen` alone. To replace the
    opening, take the shape away first: `with_shape(motion, "jawOpen", 0)`.

    Raises MotionError for a joint the head lacks and for malformed keyframes.
    """
    check_motion(motion)
    index = joint_index(motion.head, joint)
    times, vectors = read_keyframes(as_keyframes(rotations), f"pose of {joint}")
    if vectors.shape[1] != 3:
        raise MotionError.about(
            f"pose of {joint}", found=f"{vectors.shape[1]} numbers", allowed="three: x, y, z"
        )
    vectors = np.radians(vectors) if degrees else vectors
    turns = from_axis_angle(smooth(times, vectors, motion.times_s))
    posed = _rotations(motion)
    posed[:, index] = multiply(turns, posed[:, index])
    return replace(motion, rotations=posed)


def without_pose(motion: Motion) -> Motion:
    """The same motion in zero pose: shapes only, as VOCA puts it out."""
    check_motion(motion)
    return replace(motion, rotations=None)


def _rotations(motion: Motion) -> NDArray[np.float32]:
    if motion.rotations is None:
        return no_turn(motion.frame_count, len(motion.head.joint_names))
    return motion.rotations.copy()
