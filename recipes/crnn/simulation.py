"""Motion of phones with known times, at the frame rate of the second paper."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from elocute.articulation.driver import articulate, posteriors_from_phones
from elocute.articulation.style import STYLES
from elocute.head.builtin import load_builtin_head
from recipes.encoder.store import LABEL_RATE

FPS = 30.0


def simulate(phones: list[tuple[float, float, str]], duration_s: float, style: str) -> np.ndarray:
    """(frame, component) weights of the built-in head; nobody blinks, as blinks cannot be heard."""
    head = load_builtin_head()
    curves = articulate(
        posteriors_from_phones(phones, duration_s, LABEL_RATE),
        LABEL_RATE,
        frame_count=max(1, round(duration_s * FPS)),
        fps=FPS,
        style=replace(STYLES[style], blink_per_min=0.0),
    )
    return curves.select(head.expression_names).values
