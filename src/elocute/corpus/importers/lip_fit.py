"""Fitting the built-in head's speech shapes to lips that were tracked in video.

The rows of one least-squares problem, all in millimetres: where the lip points went (x and y;
depth counts little, since it was guessed from one picture), how far the lips are apart, how
wide the mouth is, and how far lips and chin are from the nose. Weights lie in 0 to 1 and change
smoothly over time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.head.model import HeadModel
from elocute.numerics.bounded_least_squares import solve_box_chain
from elocute.numerics.resampling import interpolate
from elocute.one_line_repr import one_line

SPEECH_SHAPES = (
    "jawOpen",
    "jawForward",
    "mouthClose",
    "mouthFunnel",
    "mouthPucker",
    "mouthSmileLeft",
    "mouthSmileRight",
    "mouthStretchLeft",
    "mouthStretchRight",
    "mouthRollLower",
    "mouthRollUpper",
    "mouthShrugLower",
    "mouthShrugUpper",
    "mouthPressLeft",
    "mouthPressRight",
    "mouthLowerDownLeft",
    "mouthLowerDownRight",
    "mouthUpperUpLeft",
    "mouthUpperUpRight",
    "mouthLabiodental",
)

AXIS_WEIGHTS = (1.0, 1.0, 0.2)  # x, y, z
GAP_WEIGHT, CLOSED_GAP_WEIGHT = 2.0, 30.0
MEAN_GAP_WEIGHT, WIDTH_WEIGHT, LIP_WEIGHT, JAW_WEIGHT = 8.0, 3.0, 2.0, 2.0
PULL_MM2 = 2.0  # what a squared weight costs: decides between shapes that look alike
# Shapes that one picture of the lips hardly distinguishes from others cost more.
SHAPE_COSTS = {
    "mouthLabiodental": 100.0,
    "mouthShrugUpper": 40.0,
    "mouthShrugLower": 40.0,
    "jawForward": 60.0,
    "mouthClose": 10.0,
}
SMOOTH_MM2 = 6.0  # what a squared change between two frames costs


@dataclass(frozen=True, eq=False)
class LipMotion:
    """Tracked lips as displacements from the talker's rest, at the size of the head."""

    # (frame, contour, point, 3) along `LIP_CONTOURS` of the face mesh, mm; inner lips that touch
    # move together.
    points: Float64Array
    gap: Float64Array  # (frame,) between the inner lips, mm; 0 where they touch
    closed: NDArray[np.bool_]  # (frame,) whether they touch
    width: Float64Array  # (frame,) how much wider the mouth is than at rest, mm
    # (frame,) how much further than at rest upper lip, lower lip and chin are from the nose, mm.
    upper: Float64Array
    lower: Float64Array
    jaw: Float64Array

    __repr__ = one_line


@dataclass(frozen=True, eq=False)
class LipShapeEffects:
    """What one unit of each speech shape does at the places where lips are tracked, mm."""

    points: Float64Array  # (component, contour, point, 3) displacements of the tracked points
    # (component, column) of the inner lips, over the head's columns of lip vertices.
    gaps: Float64Array
    middle: Float64Array  # (component,) mean gap of the columns that `measure_mouth` takes
    # (component,) as in `LipMotion`.
    width: Float64Array
    upper: Float64Array
    lower: Float64Array
    jaw: Float64Array
    # (column, point) interpolates a gap along `INNER_UPPER` to the head's columns.
    share: Float64Array


def lip_shape_effects(head: HeadModel, rest: Float64Array) -> LipShapeEffects:
    """Find the tracked points on the head's lips by arc length between the corners of the mouth.

    Parameters
    ----------
    head : HeadModel
        With the shapes of `SPEECH_SHAPES`.
    rest : (contour, point, 3) float64
        The talker's resting lips, in any unit.

    Returns
    -------
    LipShapeEffects
        Of this head.
    """
    chosen = [head.expression_index(name) for name in SPEECH_SHAPES]
    basis = 1000 * head.expression_basis[chosen].astype(np.float64)
    outer, inner = head.outer_corners, head.inner_corners
    rings = [
        np.concatenate([ends[:1], middle, ends[1:]])
        for middle, ends in (
            (head.outer_lip_upper, outer),
            (head.outer_lip_lower, outer),
            (head.inner_lip_upper, inner),
            (head.inner_lip_lower, inner),
        )
    ]
    points, shares = [], []
    for ring, contour in zip(rings, rest, strict=True):
        along = _arc_length(head.template[ring].astype(np.float64))
        share = _interpolation(_arc_length(contour), along)
        points.append(np.einsum("pv,cva->cpa", share, basis[:, ring]))
        shares.append(_interpolation(along[1:-1], _arc_length(contour)))
    upper, lower = head.inner_lip_upper, head.inner_lip_lower
    gaps = basis[:, upper, 1] - basis[:, lower, 1]
    third = len(upper) // 3
    chin, top, bottom = head.landmarks[8], head.landmarks[51], head.landmarks[57]
    return LipShapeEffects(
        np.stack(points, axis=1),
        gaps,
        gaps[:, third : len(upper) - third].mean(axis=1),
        basis[:, outer[1], 0] - basis[:, outer[0], 0],
        -basis[:, top, 1],
        -basis[:, bottom, 1],
        -basis[:, chin, 1],
        shares[2],
    )


def fit_lips(rows: LipShapeEffects, lips: LipMotion) -> tuple[Float64Array, float]:
    """Fit the speech shapes to tracked lips, all frames of a clip together.

    Parameters
    ----------
    rows : LipShapeEffects
        What the shapes do.
    lips : LipMotion
        What is to be fitted.

    Returns
    -------
    weights : (frame, shape) float64
        0 to 1, in the order of `SPEECH_SHAPES`.
    residual_mm : float
        RMS distance of the points in x and y, mm.
    """
    count = len(rows.middle)
    low, high = np.zeros(count), np.ones(count)
    pull = PULL_MM2 * np.array([SHAPE_COSTS.get(name, 1.0) for name in SPEECH_SHAPES])
    open_gram, open_side = _normal(rows, lips, GAP_WEIGHT)
    closed_gram, closed_side = _normal(rows, lips, CLOSED_GAP_WEIGHT)
    side = np.where(lips.closed[:, None], closed_side, open_side)
    steady = np.diag(pull)
    weights = solve_box_chain(
        lambda frame: (closed_gram if lips.closed[frame] else open_gram) + steady,
        side,
        np.full(count, SMOOTH_MM2),
        low,
        high,
    )
    moved = np.einsum("fc,ckpa->fkpa", weights, rows.points)
    left = (moved - lips.points)[..., :2]
    return weights, float(np.sqrt((left**2).sum(axis=-1).mean()))


def _normal(
    rows: LipShapeEffects, lips: LipMotion, gap_weight: float
) -> tuple[Float64Array, Float64Array]:
    """Gram matrix (component, component) and right-hand sides (frame, component)."""
    count, frames = len(rows.middle), len(lips.gap)
    axes = np.asarray(AXIS_WEIGHTS)
    upper, lower = lips.points[:, 2, :, 1], lips.points[:, 3, :, 1]
    columns = (
        ((rows.points * axes).reshape(count, -1), (lips.points * axes).reshape(frames, -1)),
        (gap_weight * rows.gaps, gap_weight * (upper - lower) @ rows.share.T),
        _single(MEAN_GAP_WEIGHT, rows.middle, lips.gap),
        _single(WIDTH_WEIGHT, rows.width, lips.width),
        _single(LIP_WEIGHT, rows.upper, lips.upper),
        _single(LIP_WEIGHT, rows.lower, lips.lower),
        _single(JAW_WEIGHT, rows.jaw, lips.jaw),
    )
    model = np.concatenate([left for left, _ in columns], axis=1)
    target = np.concatenate([right for _, right in columns], axis=1)
    return model @ model.T, target @ model.T


def _single(
    weight: float, row: Float64Array, target: Float64Array
) -> tuple[Float64Array, Float64Array]:
    """One row of the model (component, 1) and its targets (frame, 1), weighted."""
    return weight * row[:, None], weight * target[:, None]


def _arc_length(line: Float64Array) -> Float64Array:
    """(point,) share of the way along a line (point, 3), 0 to 1."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    return along / along[-1]


def _interpolation(places: Float64Array, along: Float64Array) -> Float64Array:
    """(place, knot) matrix that interpolates linearly between knots at `along`."""
    return interpolate(along, np.eye(len(along)), places)
