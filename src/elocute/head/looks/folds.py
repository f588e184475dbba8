"""Folds of the built-in head: where they are, and how deep an age makes them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from elocute.head.folds import Folds, folds_of_arrays
from elocute.head.looks import baked
from elocute.head.looks.subdivision import finer_face
from elocute.head.model import HeadModel

PLACE = "skins/folds"
AGES = (20.0, 35.0, 50.0, 70.0)
DEPTHS = (0.21, 0.26, 0.60, 1.0)
LINES = (0.0, 0.15, 0.6, 1.0)
"""Depth of the folds, and of the finer lines between them, at these ages."""


def fold_depth(age: float) -> float:
    """How deep an expression folds skin of some years, 0 to 1."""
    return float(np.interp(age, AGES, DEPTHS))


def fold_lines(age: float) -> float:
    """How much of the finer lines comes with them, 0 to 1."""
    return float(np.interp(age, AGES, LINES))


def folds_of(head: HeadModel) -> Folds | None:
    """The folds of a head that is drawn, or None for one whose surfaces have none."""
    if not any(surface.folds for surface in head.surfaces.values()):
        return None
    folds = _baked()
    # Images may come with any mesh; where folds are is known of the built-in one alone.
    return folds if head.vertex_count >= finer_face().count else None


@cache
def _baked() -> Folds:
    folds, finer = folds_of_arrays(baked.arrays(PLACE)), finer_face()
    masks = np.zeros((finer.count, folds.masks.shape[1]), np.uint8)
    masks[: len(folds.masks)] = folds.masks
    more = np.round(finer.between(masks)).astype(np.uint8)
    return replace(folds, masks=np.vstack([masks, more]))
