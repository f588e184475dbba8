"""Motion of phones with known times, at the frame rate of the second paper."""

from __future__ import annotations

import numpy as np

from recipes.corpus.faces import rig_weights

FPS = 30.0


def simulate(phones: list[tuple[float, float, str]], duration_s: float, style: str) -> np.ndarray:
    """(frame, component) weights of the built-in head."""
    return rig_weights(phones, duration_s, style, FPS)
