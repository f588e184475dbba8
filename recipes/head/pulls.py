"""Soft pulls and folds of the skin, as muscles of the face make them.

Places are millimetres on the front of the neutral face: outwards from the middle, upwards from
the height of the eyes. All is drawn for the left side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from recipes.head.face import NeutralFace

FRONT_M = 0.06
"""Behind the eyes by which much the skin is no longer that of the face."""


@dataclass(frozen=True)
class Pull:
    """The skin round a place moves, less with distance as a Gaussian falls. Millimetres."""

    at: tuple[float, float]
    by: tuple[float, float, float]
    reach: tuple[float, float]


@dataclass(frozen=True)
class Fold:
    """A valley along a line, and on its outer side the crest that makes it. Millimetres.

    line: from its upper end to its lower one; the fold fades out towards both.
    """

    line: tuple[tuple[float, float], ...]
    valley: float
    crest: float
    width: float = 2.6


def pulled(face: NeutralFace, *parts: Pull | Fold) -> np.ndarray:
    """(skin vertex, 3) m: what these parts do to the left side of the neutral face."""
    eye = face.assembly.eye_centre
    skin = (face.skin - [0, eye[1], eye[2]]) * 1000
    front = np.clip(skin[:, 2] / (FRONT_M * 1000) + 1, 0, 1)
    moved = np.zeros_like(skin)
    for part in parts:
        moved += _gaussian(part, skin) if isinstance(part, Pull) else _folded(part, skin)
    return moved * front[:, None] / 1000


def both_sides(face: NeutralFace, left: np.ndarray) -> dict[str, np.ndarray]:
    """A displacement of the left side, and its mirror image."""
    return {"Left": left, "Right": left[face.anatomy.skin_mirror] * [-1, 1, 1]}


def _gaussian(pull: Pull, skin_mm: np.ndarray) -> np.ndarray:
    away = (skin_mm[:, :2] - pull.at) / pull.reach
    return np.exp(-(away**2).sum(1))[:, None] * pull.by


def _folded(fold: Fold, skin_mm: np.ndarray) -> np.ndarray:
    line = np.array(fold.line)
    starts, ways = line[:-1], np.diff(line, axis=0)
    lengths = np.linalg.norm(ways, axis=1)
    offset = skin_mm[:, None, :2] - starts
    share = np.clip((offset * ways).sum(2) / lengths**2, 0, 1)
    nearest = offset - share[..., None] * ways
    distance = np.linalg.norm(nearest, axis=2)
    piece = distance.argmin(1)
    rows = np.arange(len(skin_mm))
    # Outwards of a line that runs down lies to its left.
    outer = (ways[piece, 0] * offset[rows, piece, 1] - ways[piece, 1] * offset[rows, piece, 0]) > 0
    across = np.where(outer, 1, -1) * distance[rows, piece]
    along = (np.r_[0, np.cumsum(lengths)][piece] + share[rows, piece] * lengths[piece]) / sum(
        lengths
    )
    strength = np.sin(np.pi * np.clip(0.12 + 0.76 * along, 0, 1))
    valley = fold.valley * np.exp(-((across / fold.width) ** 2))
    crest = fold.crest * np.exp(-(((across - 2.2 * fold.width) / (1.6 * fold.width)) ** 2))
    return np.stack([0 * across, 0 * across, strength * (crest - valley)], 1)
