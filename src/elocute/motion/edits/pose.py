"""Pose: head, neck, jaw and eyes turned over time (VOCA 2019, section 4 and Figure 7)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elocute.errors import MotionError
from elocute.head.joints import joint_index
from elocute.motion.edits.keyframes import Keyframes, as_keyframes, between_keys, read_keyframes
from elocute.motion.motion import Motion, check_motion
from elocute.numerics.quaternions import from_axis_angle, multiply, no_turn


def with_pose(
    motion: Motion,
    joint: str,
    rotations: Keyframes | ArrayLike,
    *,
    degrees: bool = True,
    between: str = "smooth",
) -> Motion:
    """Turn a joint, after whatever it did already.

    Parameters
    ----------
    motion : Motion
        On a head with that joint.
    joint : str
        As the head names it: neck, head, jaw, eyeLeft or eyeRight.
    rotations : (x, y, z) or keyframes [(time s, (x, y, z)), …]
        Axis-angle vectors: the direction is the axis, the length the angle. +x nods (chin down), +y
        turns to the head's own left, +z tilts to its own right. One vector holds for the whole
        motion; between keyframes each component follows a cubic without overshoot, and outside
        them it holds.
    degrees : bool
        Whether angles are degrees; radians otherwise.
    between : str
        "smooth" follows cubics without overshoot between keyframes, "linear" straight lines.

    Returns
    -------
    Motion

    Raises
    ------
    MotionError
        For a joint that the head lacks, and for malformed keyframes.

    Notes
    -----
    The new rotation comes after the joint's old one, in its parent's frame, so the opposite angles
    take it back. It turns what the shapes have made: the shape `jawOpen` is already the opening of
    the jaw joint (20 degrees at weight one on the built-in head), so a jaw pose opens the mouth
    further by its own angle and leaves the weight of `jawOpen` alone. To replace the opening,
    remove the shape first: `with_shape(motion, "jawOpen", 0)`.

    References
    ----------
    VOCA 2019, section 4 and Figure 7.
    """
    check_motion(motion)
    index = joint_index(motion.head, joint)
    times, vectors = read_keyframes(as_keyframes(rotations), f"pose of {joint}")
    if vectors.shape[1] != 3:
        raise MotionError.about(
            f"pose of {joint}", found=f"{vectors.shape[1]} numbers", allowed="three: x, y, z"
        )
    vectors = np.radians(vectors) if degrees else vectors
    turns = from_axis_angle(between_keys(times, vectors, motion.times_s, between))
    posed = _rotations(motion)
    posed[:, index] = multiply(turns, posed[:, index])
    return replace(motion, rotations=posed)


def without_pose(motion: Motion) -> Motion:
    """The same motion in zero pose: shapes only, as VOCA gives it. Raises MotionError."""
    check_motion(motion)
    return replace(motion, rotations=None)


def _rotations(motion: Motion) -> NDArray[np.float32]:
    if motion.rotations is None:
        return no_turn(motion.frame_count, len(motion.head.joint_names))
    return motion.rotations.copy()
