"""Soft tissue: flesh that lags behind, overshoots and comes to rest, as a damped spring does.

The flesh of a place follows x'' = ω²(u - x) - 2ζω·x' where u is where bone and muscle would have
it. As u is a weighted sum of fields, x is the same sum with filtered weights; so a place costs a
filter of weights instead of one of vertices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float64Array
from recipes.rich_faces.face_places import FacePlaces


@dataclass(frozen=True)
class Flesh:
    """A place of soft tissue: middle and width in mm, how loose it is, and how it swings."""

    name: str
    middle: tuple[float, float, float]
    width: float
    share: float
    hertz: float
    damping: float


FLESH: tuple[Flesh, ...] = (
    Flesh("cheek left", (42, -46, 64), 15, 0.60, 5.5, 0.40),
    Flesh("cheek right", (-42, -46, 64), 15, 0.60, 5.5, 0.40),
    Flesh("jowl left", (36, -80, 50), 13, 0.60, 5.0, 0.38),
    Flesh("jowl right", (-36, -80, 50), 13, 0.60, 5.0, 0.38),
    Flesh("chin", (0, -95, 82), 10, 0.35, 8.0, 0.45),
    Flesh("under the jaw", (0, -104, 52), 17, 0.70, 4.2, 0.40),
    Flesh("throat", (0, -128, 36), 18, 0.60, 3.6, 0.45),
)


def flesh_masks(places: FacePlaces, calm: Float64Array) -> Float64Array:
    """(place, vertex) share of the flesh that swings; calm (vertex,) keeps the lips out."""
    masks = np.stack([flesh.share * places.bell(*flesh.middle, flesh.width) for flesh in FLESH])
    masks *= calm * places.soft
    return np.where(masks > 0.004, masks, 0)


def lagging(
    weights: Float64Array, fps: float, hertz: Float64Array, damping: Float64Array
) -> Float64Array:
    """Weights as the flesh of each place follows them.

    Parameters
    ----------
    weights
        (frame, field), linear between frames; the flesh rests at the first.
    fps
        Frames per second.
    hertz, damping
        (place,) undamped frequency and share of the critical damping, below 1.

    Returns
    -------
    (place, frame, field), exact for input that is linear between frames.
    """
    step = 1 / fps
    omega = 2 * np.pi * hertz[:, None]
    decay, swing = damping[:, None] * omega, omega * np.sqrt(1 - damping[:, None] ** 2)
    shrink = np.exp(-decay * step)
    cos, sin = np.cos(swing * step), np.sin(swing * step)
    out = np.empty((len(hertz), *weights.shape))
    at = np.repeat(weights[None, 0], len(hertz), axis=0)
    speed = np.zeros_like(at)
    out[:, 0] = at
    behind = 2 * damping[:, None] / omega  # a ramp is followed so much later
    for frame in range(1, len(weights)):
        ramp = (weights[frame] - weights[frame - 1]) / step
        # Free swinging about the steady answer to the ramp: u(t) - behind·ramp.
        off = at - (weights[frame - 1] - behind * ramp)
        rate = speed - ramp
        pull = (rate + decay * off) / swing
        free = shrink * (off * cos + pull * sin)
        speed = ramp - decay * free + shrink * swing * (pull * cos - off * sin)
        at = weights[frame] - behind * ramp + free
        out[:, frame] = at
    return out
