"""One shape over time: a smile added to speech, a jaw shut, a brow raised."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from elocute.errors import MotionError
from elocute.motion.edits.keyframes import Keyframes, as_keyframes, between_keys, read_keyframes
from elocute.motion.motion import Motion, check_motion
from elocute.numerics.input_checks import check_kind


def with_shape(
    motion: Motion,
    name: str,
    weights: Keyframes | float,
    *,
    add: bool = False,
    between: str = "smooth",
) -> Motion:
    """Set the weight of a shape over time, or add to it.

    Parameters
    ----------
    motion : Motion
        On a head with that shape.
    name : str
        The shape, `mouthSmileLeft` for example.
    weights : float or keyframes [(time s, weight), …]
        One number holds for the whole motion; keyframes have cubics without overshoot between them.
    add : bool
        Add to the weight that is there instead of replacing it.
    between : str
        "smooth" follows cubics without overshoot between keyframes, "linear" straight lines.

    Returns
    -------
    Motion

    Raises
    ------
    MotionError
        For a shape that the head lacks, and for malformed keyframes.
    """
    check_motion(motion)
    column = shape_index(motion, name)
    times, values = read_keyframes(as_keyframes(weights), f"shape {name}")
    if values.shape[1] != 1:
        raise MotionError.about(f"shape {name}", found=f"{values.shape[1]} numbers", allowed="one")
    changed = motion.weights.copy()
    curve = between_keys(times, values, motion.times_s, between)[:, 0].astype(np.float32)
    changed[:, column] = changed[:, column] + curve if add else curve
    return replace(motion, weights=changed)


def shape_index(motion: Motion, name: str) -> int:
    """The column of a shape. Raises MotionError where the head lacks it."""
    check_kind("shape", name, str, ", ".join(motion.names[:60]), MotionError)
    if name not in motion.names:
        raise MotionError.about(
            f"shape {name!r}",
            found=f"no such shape on head {motion.head.name!r}",
            allowed=", ".join(motion.names[:60]),
        )
    return motion.names.index(name)
