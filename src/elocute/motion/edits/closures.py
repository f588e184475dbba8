"""Finds sealed lips, keeps them through other edits, and holds lips shut."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from elocute.errors import MotionError
from elocute.motion.edits.windows import window
from elocute.motion.motion import Motion, check_motion
from elocute.motion.mouth_measures import measure_mouth
from elocute.numerics.input_checks import real_number
from elocute.numerics.smoothing import smoothstep
from elocute.one_line_repr import brief

SEALED_MM = 0.1
"""Lips no further apart count as sealed."""
RAMP_S = 0.05  # lips take this long to meet, and to part again, as at p, b and m
JAW_LEFT = 0.4  # share of the jaw's opening that stays behind closed lips
PRESSED = 0.15  # weight of mouthPress in lips that are held
CLOSED_BLEND_S = 0.08
# What parts lips, or lies between them.
PARTING = (
    *("mouthUpperUp", "mouthLowerDown", "mouthStretch", "mouthFunnel", "mouthShrug"),
    *("mouthLabiodental", "mouthRoll", "tongueOut", "tongueDental", "tongueTipUp"),
)


def sealed_frames(motion: Motion) -> NDArray[np.bool_]:
    """Where lips are sealed.

    Parameters
    ----------
    motion : Motion
        Of any head.

    Returns
    -------
    (frame,) bool
        None on a head without lips to measure.
    """
    return _openings_mm(motion) <= SEALED_MM


def _openings_mm(motion: Motion) -> NDArray[np.float64]:
    if not len(motion.head.inner_lip_upper) or not len(motion.head.landmarks):
        return np.full(motion.frame_count, np.inf)
    return measure_mouth(motion)["opening_mm"].astype(np.float64)


def mouth_columns(motion: Motion) -> list[int]:
    """Columns of the shapes that move jaw, lips and tongue."""
    return [i for i, n in enumerate(motion.names) if n.startswith(("jaw", "mouth", "tongue"))]


def keep_contacts(before: Motion, after: Motion, size: NDArray[np.float64] | float = 1.0) -> Motion:
    """Take back what an edit did to contacts: lips that were sealed, a lip at the teeth.

    Parameters
    ----------
    before, after : Motion
        Without and with the edit; the same frames.
    size : (frame,) or float
        Sealed lips come back as this part of what they were, 0 to 1. A smaller jaw need not open
        for a contact: lips together at rest and at the contact are together between them.

    Returns
    -------
    Motion
        `after`, but for frames where it parts what was in contact, and 50 ms around them.
    """
    columns = mouth_columns(before)
    broken = sealed_frames(before) & (_openings_mm(after) > SEALED_MM)
    weights = after.weights.copy()
    part = np.broadcast_to(size, before.frame_count)[:, None]
    was = before.weights[:, columns]
    gate = _ramped(broken, before.fps)[:, None]
    weights[:, columns] = (1 - gate) * weights[:, columns] + gate * part * was
    if "mouthLabiodental" in before.names:
        teeth = before.weights[:, before.names.index("mouthLabiodental")]
        gate = smoothstep(np.clip(teeth / max(0.2, float(teeth.max())), 0, 1))[:, None]
        weights[:, columns] = (1 - gate) * weights[:, columns] + gate * was
    return replace(after, weights=weights)


def _ramped(frames: NDArray[np.bool_], fps: float) -> NDArray[np.float64]:
    """(frame,) 1 at these frames, down to 0 within RAMP_S of them."""
    gate = np.zeros(len(frames))
    steps = np.arange(int(np.ceil(RAMP_S * fps)) + 1)
    for step, height in enumerate(smoothstep(np.clip(1 - steps / fps / RAMP_S, 0, 1))):
        gate[step:] = np.maximum(gate[step:], height * frames[: len(frames) - step])
        gate[: len(frames) - step] = np.maximum(gate[: len(frames) - step], height * frames[step:])
    return gate


def with_lips_closed(
    motion: Motion, start_s: float, stop_s: float, *, blend_s: float = CLOSED_BLEND_S
) -> Motion:
    """Hold the lips sealed for a while, whatever is said.

    Parameters
    ----------
    motion : Motion
        On a head with the shapes jawOpen and mouthClose.
    start_s, stop_s : float
        The lips are sealed from here to there, s.
    blend_s : float
        They close this long before and part this long after.

    Returns
    -------
    Motion

    Raises
    ------
    MotionError
        For a head without these shapes, and times that do not rise within the motion.
    """
    check_motion(motion)
    start, stop, around = real_number(start_s), real_number(stop_s), real_number(blend_s)
    if start is None or stop is None or not 0 <= start < stop:
        raise MotionError.about(
            "closed lips", found=f"{brief(start_s)} to {brief(stop_s)} s", allowed="0 s on, rising"
        )
    if around is None or not 0 <= around <= 10:
        raise MotionError.about("closed lips", found=f"blend {brief(blend_s)}", allowed="0 to 10 s")
    return closed_by(motion, window(motion.times_s, start, stop, (around, around), around=True))


def closed_by(motion: Motion, gate: NDArray[np.float64]) -> Motion:
    """Close the lips as far as `gate` (frame,), 0 to 1, says. Raises MotionError."""
    missing = {"jawOpen", "mouthClose"} - set(motion.names)
    if missing:
        raise MotionError.about(
            "closed lips",
            found=f"head {motion.head.name!r} without {', '.join(sorted(missing))}",
            allowed="a head with both shapes",
        )
    weights = motion.weights.copy()
    column = {name: weights[:, place] for place, name in enumerate(motion.names)}
    left = (1 - gate).astype(np.float32)
    for name, values in column.items():
        if name.startswith(PARTING):
            values *= left
        elif name.startswith("mouthPress"):
            np.maximum(values, PRESSED * (1 - left), out=values)
    column["jawOpen"] *= 1 - (1 - JAW_LEFT) * (1 - left)
    # ARKit's mouthClose seals the lips where it equals jawOpen.
    column["mouthClose"][:] = left * column["mouthClose"] + (1 - left) * column["jawOpen"]
    return _rest_taken_back(replace(motion, weights=weights), gate)


def _rest_taken_back(motion: Motion, gate: NDArray[np.float64]) -> Motion:
    """Closed lips that other shapes of the mouth still part come nearer to their rest."""
    columns = mouth_columns(motion)
    for _ in range(20):
        open_still = (gate >= 1) & (_openings_mm(motion) > SEALED_MM / 2)
        if not open_still.any():
            break
        weights = motion.weights.copy()
        weights[:, columns] *= 1 - 0.25 * _ramped(open_still, motion.fps)[:, None]
        motion = replace(motion, weights=weights)
    return motion
