"""Weights of any set of mouth shapes that come nearest to a motion of the built-in head.

Each shape is told as weights of the head's own: a viseme is the look that the head has for it. The
weights are non-negative, few at a time, and as smooth as the motion: each frame is a strictly
convex problem, so that its solution changes no faster than what it is solved for, and a take that
is cut has the same weights.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from elocute.array_types import Float32Array, Float64Array
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from elocute.numerics.bounded_least_squares import solve_box

MOUTH = ("jaw", "mouth", "tongue")
MOVED_M = 1e-4
"""What no shape of the mouth moves further than this is left out."""
LIPS, GAP, SHUT = 4.0, 12.0, 200.0
"""How much more a vertex of the lips counts, the gap between them, and that of lips that touch."""
TOUCH_M = 1e-3
"""Lips this far apart count about a third of the way to those that touch."""
CLOSED_MM = 0.05
"""Lips that are this near touch."""
RIDGE = 1e-3  # of the mean squared length of a shape
SPARSE = 0.01  # of the same: what a weight costs, whatever the fit


@dataclass(frozen=True, eq=False)
class ControlFit:
    """Weights of mouth shapes, and how far they are from the motion.

    Attributes
    ----------
    weights : (frame, control) float32
        0 to 1.
    skin_mm : float
        Root mean square of what the skin around the mouth is off, over places that move and frames.
    opening_mm : float
        How far the opening of the lips is off, on average.
    closed_mm : float
        The widest opening where the motion's lips touch.
    """

    weights: Float32Array
    skin_mm: float
    opening_mm: float
    closed_mm: float


def is_of_mouth(curve: str) -> bool:
    """Whether a curve of the built-in head moves its mouth.

    Parameters
    ----------
    curve : str
        A name.

    Returns
    -------
    bool
    """
    return curve.startswith(MOUTH)


def fit_controls(motion: Motion, looks: Sequence[dict[str, float]]) -> ControlFit:
    """Fit weights of mouth shapes to a motion.

    Parameters
    ----------
    motion : Motion
        Of a head with the built-in head's shapes.
    looks : sequence of dict of str to float
        For each shape the curves of the head that it is, at weight one.

    Returns
    -------
    ControlFit
    """
    head = motion.head
    names = [name for name in head.expression_names if is_of_mouth(name)]
    columns = [head.expression_index(name) for name in names]
    curves = np.ascontiguousarray(motion.weights[:, columns], np.float64)
    mixes = np.array([[look.get(name, 0.0) for name in names] for look in looks], np.float64)
    parts, gaps, rows = _rows(head, columns)
    # (curve, curve): all that the fit needs of the mesh
    skin, gap = rows @ rows.T, gaps @ gaps.T
    plain, close = (mixes @ each @ mixes.T for each in (skin, gap))
    mean = float(np.trace(plain)) / max(1, len(plain))
    plain[np.diag_indices_from(plain)] += RIDGE * mean
    shares = _gap_counts(curves, gaps)
    sides = (curves @ skin + shares[:, None] * (curves @ gap)) @ mixes.T - SPARSE * mean
    low, high = np.zeros(len(looks)), np.ones(len(looks))
    weights = np.stack(
        [
            solve_box(plain + share * close, side, low, high)
            for share, side in zip(shares, sides, strict=True)
        ]
    )
    off = weights @ mixes - curves
    places = max(1, parts.shape[1] // 3)
    squares = np.einsum("fc,cd,fd->f", off, parts @ parts.T, off) / places
    moved = motion.weights.copy()
    moved[:, columns] = weights @ mixes
    had, wanted = (
        measure_mouth(each)["opening_mm"] for each in (replace(motion, weights=moved), motion)
    )
    return ControlFit(
        weights.astype(np.float32),
        1000 * float(np.sqrt(max(0.0, squares.mean()))),
        float(np.abs(had - wanted).mean()),
        float(had[wanted < CLOSED_MM].max(initial=0.0)),
    )


def _gap_counts(curves: Float64Array, gaps: Float64Array) -> Float64Array:
    """(frame,) how much the gap counts: more the nearer the lips are."""
    apart = np.linalg.norm((curves @ gaps).reshape(len(curves), -1, 3), axis=2).mean(axis=1)
    touching = np.exp(-((apart / TOUCH_M) ** 2))
    return GAP**2 + (SHUT**2 - GAP**2) * touching


def _rows(head: HeadModel, columns: list[int]) -> tuple[Float64Array, Float64Array, Float64Array]:
    """What the shapes of a mouth do, m: to the skin, to the gap of the lips, and as it counts."""
    basis = head.expression_basis[columns].astype(np.float64)
    moved = np.linalg.norm(basis, axis=2).max(axis=0) > MOVED_M
    lips = np.zeros(head.vertex_count)
    lips[head.regions.get("lips", [])] = 1
    parts = basis[:, moved].reshape(len(columns), -1)
    counts = np.repeat(1 + (LIPS - 1) * lips[moved], 3)
    upper, lower = head.inner_lip_upper, head.inner_lip_lower
    gaps = (basis[:, upper] - basis[:, lower]).reshape(len(columns), -1)
    return parts, gaps, parts * counts
