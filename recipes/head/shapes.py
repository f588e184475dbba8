"""Every expression shape as a displacement (vertex, 3) of the whole head."""

from __future__ import annotations

import numpy as np

from recipes.head.arkit import NAMES
from recipes.head.eye_shapes import eye_and_brow_shapes
from recipes.head.face import NeutralFace
from recipes.head.mouth_shapes import mouth_shapes
from recipes.head.tongue_shapes import tongue_shapes

NOISE_M = 4e-6
"""Displacements below this are rounding, not shape."""
BUST_M = 0.03
"""No shape moves the cut of the neck; this high above it shapes are whole."""


def expression_basis(face: NeutralFace) -> np.ndarray:
    """(expression, vertex, 3) in the order of NAMES, exactly mirror-symmetric."""
    drawn = eye_and_brow_shapes(face) | mouth_shapes(face) | tongue_shapes(face)
    loose = face.off_the_bust(BUST_M)[:, None]
    return np.stack([_tidy(face.attached(_symmetric(face, drawn, name) * loose)) for name in NAMES])


def _symmetric(face: NeutralFace, drawn: dict[str, np.ndarray], name: str) -> np.ndarray:
    """A middle shape mirrored onto itself; a right shape is the left one's mirror image."""
    if name.endswith("Left"):
        return (drawn[name] + face.mirrored(drawn[name[:-4] + "Right"])) / 2
    if name.endswith("Right"):
        return (drawn[name] + face.mirrored(drawn[name[:-5] + "Left"])) / 2
    return face.symmetrised(drawn[name])


def _tidy(displacement: np.ndarray) -> np.ndarray:
    small = np.linalg.norm(displacement, axis=1) < NOISE_M
    return np.where(small[:, None], 0, displacement)
