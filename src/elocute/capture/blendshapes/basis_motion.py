"""A motion that shows every shape of a head in turn: how a basis is stored and viewed."""

from __future__ import annotations

import numpy as np

from elocute.head.model import HeadModel
from elocute.motion.motion import Motion

REACH = 2.0  # deviations to both sides
SHAPE_S = 1.0  # one period of a shape
FPS = 30.0


def sweep_shapes(head: HeadModel) -> Motion:
    """Each shape from 0 to +2, to -2 and back, one after another; weights are deviations."""
    frames = round(SHAPE_S * FPS)
    wave = REACH * np.sin(np.linspace(0, 2 * np.pi, frames, endpoint=False))
    weights = np.kron(np.eye(len(head.expression_names)), wave[:, None])
    return Motion(head, weights.astype(np.float32), FPS)


def extreme_shapes(motion: Motion) -> list[tuple[str, Motion]]:
    """Labels and single frames: every shape at +2 and -2 deviations, for a contact sheet."""
    head = motion.head
    found = []
    for index, name in enumerate(head.expression_names):
        for value in (REACH, -REACH):
            weights = np.zeros((1, len(head.expression_names)), np.float32)
            weights[0, index] = value
            found.append((f"{name} {value:+.0f}", Motion(head, weights, FPS)))
    return found
