"""Tongue: out of the mouth, to the ridge, between the teeth."""

from __future__ import annotations

import numpy as np

from .face import NeutralFace


def tongue_shapes(face: NeutralFace) -> dict[str, np.ndarray]:
    return {
        "tongueOut": _bent(face, out_mm=42, up_mm=7, narrow=0.15),
        "tongueTipUp": _bent(face, out_mm=5, up_mm=6, tip_mm=9, narrow=0.12),
        "tongueDental": _bent(face, out_mm=17, up_mm=8, tip_mm=2, narrow=0.1),
    }


def _bent(
    face: NeutralFace, out_mm: float, up_mm: float, tip_mm: float = 0.0, narrow: float = 0.0
) -> np.ndarray:
    """Displacement that grows towards the tip."""
    where = face.assembly.slices["tongue"]
    rest = face.vertices[where]
    tip = (rest[:, 2] - rest[:, 2].min()) / np.ptp(rest[:, 2])
    moved = np.zeros((face.assembly.count, 3))
    moved[where, 0] = -narrow * rest[:, 0] * tip**2
    moved[where, 1] = (up_mm * tip**1.2 + tip_mm * tip**4) / 1000
    moved[where, 2] = out_mm * tip**1.5 / 1000
    return moved
