"""How far a path is from the true one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from elocute.alignment.alignment import WarpingPath, check_path
from elocute.errors import AlignmentError
from elocute.numerics.resampling import interpolate

TimeSpan = tuple[float, float]
POINTS_PER_FRAME = 20  # points per frame on a true curve, before it becomes cells


def path_error(found: WarpingPath, true: WarpingPath) -> float:
    """Eq. 11 of Tzirakis et al. 2019, in frames: lower is better, 0 is the true path.

    The mean distance of each path's points from the nearest point of the other.
    """
    from scipy.spatial import KDTree

    if found.ndim != 2 or true.ndim != 2 or found.shape[1] != true.shape[1]:
        raise AlignmentError.about(
            "paths", found=f"shapes {found.shape} and {true.shape}", allowed="(step, view) alike"
        )
    there, back = KDTree(true).query(found)[0], KDTree(found).query(true)[0]
    return float((there.sum() + back.sum()) / (len(found) + len(true)))


def intersection_over_union(first: TimeSpan, second: TimeSpan) -> float:
    """Of two spans of time: 1 is the same, 0 is apart."""
    common = min(first[1], second[1]) - max(first[0], second[0])
    union = max(first[1], second[1]) - min(first[0], second[0])
    return max(0.0, common) / union if union > 0 else 1.0


def carried_overlap(
    found: WarpingPath, source: Sequence[TimeSpan], target: Sequence[TimeSpan], rate: float
) -> float:
    """Mean intersection-over-union of parts carried over: higher is better, 1 is perfect.

    Each part of the target (a phone, a word; seconds) is taken through the path to the source
    and compared with where that part truly is there. Frame k stands for the time around k / rate.
    """
    if not source or len(source) != len(target):
        raise AlignmentError.about(
            "parts", found=f"{len(source)} and {len(target)}", allowed="equally many, one at least"
        )
    overlaps = [
        intersection_over_union(_carried(found, part, rate), true)
        for part, true in zip(target, source, strict=True)
    ]
    return float(np.mean(overlaps))


def _carried(path: WarpingPath, part: TimeSpan, rate: float) -> TimeSpan:
    """Where a span of the target goes: edges between frames, interpolated along the path."""
    places = np.array(part) * rate
    targets, first = np.unique(path[:, 1], return_index=True)
    means = np.add.reduceat(path[:, 0], first) / np.diff([*first, len(path)])
    start, end = np.interp(places, targets, means)
    return float(start / rate), float(end / rate)


def true_path(
    source: NDArray[np.floating],
    target: NDArray[np.floating],
    rate: float,
    frames: tuple[int, int],
    whole: bool = True,
) -> WarpingPath:
    """The path (step, 2) whose curve is piecewise linear between corresponding times.

    source, target: (boundary,) seconds, none going back, that mean the same in both; frames: of
    each view. Where `whole`, the ends of both views correspond too. Raises AlignmentError.
    """
    if len(source) != len(target) or len(source) < 2 or rate <= 0:
        raise AlignmentError.about(
            "boundaries",
            found=f"{len(source)} and {len(target)}",
            allowed="equally many, two at least, at a rate above 0 Hz",
        )
    knots = np.stack([source, target], axis=1) * rate
    if (np.diff(knots, axis=0) < 0).any() or not np.isfinite(knots).all():
        raise AlignmentError.about("boundaries", found="times that go back", allowed="in order")
    ends = np.array(frames) - 1.0
    knots = np.clip(knots, 0, ends)
    if whole:
        knots = np.concatenate([[[0.0, 0.0]], knots, [ends]])
    lengths = np.abs(np.diff(knots, axis=0)).max(axis=1)
    along = np.concatenate([[0], np.cumsum(np.maximum(lengths, 1e-9))])
    fine = np.linspace(0, along[-1], max(2, int(along[-1] * POINTS_PER_FRAME)))
    curve = interpolate(along, knots, fine)
    cells = np.unique(np.floor(curve + 0.5).astype(np.intp), axis=0)
    # Cells of a curve that rises in both come out in order; sorting by the sum keeps ties so.
    cells = cells[np.argsort(cells.sum(axis=1), kind="stable")]
    check_path(cells, frames) if whole else None
    return cells
