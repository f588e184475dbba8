"""How much of an edit holds at each frame, and two motions mixed by it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from elocute.motion.motion import Motion
from elocute.numerics.quaternions import blend, no_turn
from elocute.numerics.smoothing import smoothstep


def window(
    times_s: NDArray[np.float64],
    start_s: float | None,
    stop_s: float | None,
    blend_s: tuple[float, float],
    *,
    around: bool = False,
) -> NDArray[np.float64]:
    """How much of an edit holds.

    Parameters
    ----------
    times_s : (frame,)
        Seconds.
    start_s, stop_s : float or None
        None for an end of the motion, where nothing is blended.
    blend_s : (float, float)
        How long it comes and goes, s; in a shorter window in proportion.
    around : bool
        Blend before `start_s` and after `stop_s` instead of within.

    Returns
    -------
    (frame,) 0 to 1.
    """
    come, go = blend_s
    if start_s is not None and stop_s is not None and not around and come + go > stop_s - start_s:
        come, go = (part * (stop_s - start_s) / (come + go) for part in blend_s)
    share = np.ones(len(times_s))
    if start_s is not None:
        share = np.minimum(share, _ramp(times_s - start_s + (come if around else 0.0), come))
    if stop_s is not None:
        share = np.minimum(share, _ramp(stop_s - times_s + (go if around else 0.0), go))
    return share


def _ramp(since_s: NDArray[np.float64], length_s: float) -> NDArray[np.float64]:
    """(frame,) from 0 to 1 within a length. A microsecond forgives times of rounded decimals."""
    if length_s <= 0:
        return (since_s >= -1e-6).astype(np.float64)
    return np.asarray(smoothstep(np.clip((since_s + 1e-6) / length_s, 0, 1)), np.float64)


def mixed(before: Motion, after: Motion, share: NDArray[np.float64]) -> Motion:
    """Two motions of one head and length, mixed frame by frame.

    Parameters
    ----------
    before, after : Motion
        Of the same frames and components.
    share : (frame,)
        Of `after`, 0 to 1.

    Returns
    -------
    Motion
    """
    part = share[:, None].astype(np.float32)
    weights = np.where(part == 1, after.weights, before.weights)
    between = (share > 0) & (share < 1)
    weights[between] = (before.weights + part * (after.weights - before.weights))[between]
    rotations = before.rotations
    if after.rotations is not before.rotations:
        still = no_turn(before.frame_count, len(before.head.joint_names))
        first = still if before.rotations is None else before.rotations
        second = still if after.rotations is None else after.rotations
        rotations = blend(first, second, share[:, None, None]).astype(np.float32)
    return replace(after, weights=weights, rotations=rotations)
