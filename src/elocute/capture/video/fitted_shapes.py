"""Which of the built-in head's shapes a video is fitted with, and what each costs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Not told by points on the skin: the tongue, cheeks puffed towards the camera.
UNSEEN = ("tongueOut", "tongueTipUp", "tongueDental", "cheekPuff")

PULL = 4.0
"""What a squared weight costs, in variances of the detector's error: decides between shapes that
look alike."""
SPARSE = 1.5
"""What a weight costs in itself: small ones vanish."""
STEADY = 2.0
"""What a squared change between two frames at 25 Hz costs."""
# Shapes that the points of one picture hardly tell from others cost more.
DEAR = {
    "mouthLowerDownLeft": 0.5,
    "mouthLowerDownRight": 0.5,
    "mouthLabiodental": 15.0,
    "mouthShrugUpper": 10.0,
    "mouthShrugLower": 8.0,
    "jawForward": 20.0,
    "mouthClose": 2.0,
    "jawLeft": 4.0,
    "jawRight": 4.0,
    "mouthLeft": 2.0,
    "mouthRight": 2.0,
    "cheekSquintLeft": 6.0,
    "cheekSquintRight": 6.0,
    "noseSneerLeft": 4.0,
    "noseSneerRight": 4.0,
    "mouthDimpleLeft": 3.0,
    "mouthDimpleRight": 3.0,
    "mouthFrownLeft": 2.0,
    "mouthFrownRight": 2.0,
    "eyeSquintLeft": 12.0,
    "eyeSquintRight": 12.0,
    "eyeWideLeft": 3.0,
    "eyeWideRight": 3.0,
}
# What moves slowly, by the beginning of its name.
CALM = {
    "brow": 25.0,
    "eyeLook": 6.0,
    "eyeSquint": 15.0,
    "eyeWide": 15.0,
    "eyeBlink": 0.5,
    "cheek": 8.0,
    "nose": 8.0,
    "jawForward": 4.0,
}
# Both sides do nearly the same: what a squared difference costs, by the beginning of the name.
EVEN = {"eyeBlink": 30.0, "eyeSquint": 10.0, "eyeWide": 10.0, "brow": 10.0, "mouth": 3.0}
EYES_TOGETHER = 60.0  # both look the same way


def fitted_names(names: tuple[str, ...]) -> tuple[str, ...]:
    """Those of a head's shapes that a video tells."""
    return tuple(name for name in names if name not in UNSEEN)


def pulls(names: tuple[str, ...]) -> Floats:
    """(component,) cost of squared weights."""
    return PULL * np.array([DEAR.get(name, 1.0) for name in names])


def steadiness(names: tuple[str, ...], fps: float) -> Floats:
    """(component,) cost of squared changes between frames: per time, whatever the frame rate."""
    return STEADY * fps / 25 * np.array([_by_start(CALM, name, 1.0) for name in names])


def ties(names: tuple[str, ...]) -> Floats:
    """(component, component) cost of left and right doing different things."""
    cost = np.zeros((len(names), len(names)))
    for i, name in enumerate(names):
        other, strength = name.replace("Left", "Right"), _by_start(EVEN, name, 0.0)
        if name.startswith("eyeLook"):
            strength = EYES_TOGETHER
            other = other.replace("In", "?").replace("Out", "In").replace("?", "Out")
        if name.endswith("Left") and other in names:
            j = names.index(other)
            cost[[i, j], [i, j]] += strength
            cost[[i, j], [j, i]] -= strength
    return cost


def _by_start(table: dict[str, float], name: str, usual: float) -> float:
    return next((value for start, value in table.items() if name.startswith(start)), usual)
