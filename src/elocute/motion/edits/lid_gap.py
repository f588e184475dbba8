"""How far eyes stand open: a blink has to reach across, also while the face changes."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from elocute.head.model import HeadModel
from elocute.motion.motion import Motion

IDENTITY_NAME = re.compile(r"identity(\d{3})")


def identity_columns(motion: Motion) -> list[int]:
    """Columns of the components that change the face itself: identity000, identity001, …"""
    return [i for i, name in enumerate(motion.names) if IDENTITY_NAME.fullmatch(name)]


def lid_scale(motion: Motion, side: str) -> NDArray[np.float32]:
    """(frame,) how much further a lid travels than on the head's template; one for most motions.

    A blink shape fits the eye of the template. Where identity components open it wider, a
    shut lid needs a weight above one, in proportion.
    """
    columns = identity_columns(motion)
    head = motion.head
    if not columns or not has_lids(head, side):
        return np.ones(motion.frame_count, np.float32)
    rest = lid_gap(head, head.template, side)
    slopes = np.array([lid_gap(head, head.expression_basis[c], side) for c in columns])
    return (1 + motion.weights[:, columns] @ slopes / rest).astype(np.float32)


def has_lids(head: HeadModel, side: str) -> bool:
    return all(len(head.regions.get(f"lid_{lid}_{side}", ())) for lid in ("upper", "lower"))


def lid_gap(head: HeadModel, vertices: NDArray[np.floating], side: str) -> float:
    """Mean height of the upper lid over the lower one, m; linear in the vertices (vertex, 3)."""
    upper, lower = (vertices[head.regions[f"lid_{lid}_{side}"], 1] for lid in ("upper", "lower"))
    return float(upper.mean(dtype=np.float64) - lower.mean(dtype=np.float64))
