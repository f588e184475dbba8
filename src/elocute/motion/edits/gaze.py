"""Gaze: where the eyes look, with the lids that go along where the head has shapes for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elocute.errors import MotionError
from elocute.head.gaze import DIRECTIONS, SIDES, has_eyeballs, shape_reach_degrees
from elocute.motion.edits.keyframes import Keyframes, as_keyframes, between_keys, read_keyframes
from elocute.motion.edits.pose import with_pose
from elocute.motion.motion import Motion, check_motion


def with_gaze(
    motion: Motion, directions: Keyframes | ArrayLike, *, between: str = "smooth"
) -> Motion:
    """Let both eyes look in a direction.

    On a head with ARKit's eyeLook shapes these are set, and the lids follow; what the shapes did
    before is replaced. Elsewhere the eye joints turn, after whatever they did.

    Parameters
    ----------
    motion : Motion
        On a head with eyeLook shapes or eye joints.
    directions : (x, y) or keyframes [(time s, (x, y)), …]
        Degrees: +x looks down, +y to the head's own left. One direction holds for the whole motion;
        between keyframes each component follows a cubic without overshoot.
    between : str
        "smooth" follows cubics without overshoot between keyframes, "linear" straight lines.

    Returns
    -------
    Motion

    Raises
    ------
    MotionError
        For a head with neither, a direction further than a shape reaches at weight one, and
        malformed keyframes.
    """
    check_motion(motion)
    times, angles = read_keyframes(as_keyframes(directions), "gaze")
    if angles.shape[1] != 2:
        raise MotionError.about("gaze", found=f"{angles.shape[1]} numbers", allowed="two: x, y")
    names = [f"eyeLook{way}{side}" for side in SIDES for way in DIRECTIONS]
    if set(names) <= set(motion.names) and has_eyeballs(motion.head):
        return _by_shapes(motion, times, angles, between)
    keyframes = [(time, (x, y, 0.0)) for time, (x, y) in zip(times, angles, strict=True)]
    for side in SIDES:
        motion = with_pose(motion, f"eye{side}", keyframes, between=between)
    return motion


def _by_shapes(
    motion: Motion, times: NDArray[np.float64], angles: NDArray[np.float64], between: str
) -> Motion:
    weights = motion.weights.copy()
    curve = between_keys(times, angles, motion.times_s, between)
    for side in SIDES:
        outwards = curve[:, 1] if side == "Left" else -curve[:, 1]
        ways = {"Up": -curve[:, 0], "Down": curve[:, 0], "In": -outwards, "Out": outwards}
        for way, wanted in ways.items():
            name = f"eyeLook{way}{side}"
            reach = shape_reach_degrees(motion.head, name, side)
            if wanted.max() > reach + 0.01:
                raise MotionError.about(
                    "gaze",
                    found=f"{wanted.max():.4g} degrees",
                    allowed=f"{name} reaches {reach:.0f} degrees",
                )
            weights[:, motion.names.index(name)] = np.clip(wanted / reach, 0, 1)
    return replace(motion, weights=weights)
