"""How far a path of an alignment is from the true one."""

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
    """Mean distance of each path's points from the nearest point of the other path.

    This is Eq. 11 of Tzirakis et al. 2019.

    Parameters
    ----------
    found : (step, view) int
        A path, frames.
    true : (true_step, view) int
        The true path through the same views, frames.

    Returns
    -------
    float
        Frames; lower is better, 0 is the true path.

    Raises
    ------
    AlignmentError
        For paths of other shapes.
    """
    from scipy.spatial import KDTree

    if found.ndim != 2 or true.ndim != 2 or found.shape[1] != true.shape[1]:
        raise AlignmentError.about(
            "paths", found=f"shapes {found.shape} and {true.shape}", allowed="(step, view) alike"
        )
    there, back = KDTree(true).query(found)[0], KDTree(found).query(true)[0]
    return float((there.sum() + back.sum()) / (len(found) + len(true)))


def intersection_over_union(first: TimeSpan, second: TimeSpan) -> float:
    """Intersection over union of two spans of time.

    Parameters
    ----------
    first, second : (float, float)
        Start and end, s.

    Returns
    -------
    float
        1 where they are the same, 0 where they do not meet.
    """
    common = min(first[1], second[1]) - max(first[0], second[0])
    union = max(first[1], second[1]) - min(first[0], second[0])
    return max(0.0, common) / union if union > 0 else 1.0


def carried_overlap(
    found: WarpingPath, source: Sequence[TimeSpan], target: Sequence[TimeSpan], rate: float
) -> float:
    """Mean intersection over union of spans that a path carries from target to source.

    Parameters
    ----------
    found : (step, 2) int
        The path, frames of source and target.
    source, target : sequence of (float, float)
        Start and end in s of the same spans (phones, or a word) in each.
    rate : float
        Frames per second; frame k stands for the time around k / rate.

    Returns
    -------
    float
        0 to 1; higher is better.

    Raises
    ------
    AlignmentError
        For no span, or other numbers of them.
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
    """Where a span of the target lies in the source, interpolated along the path."""
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
    """The path whose curve is piecewise linear between corresponding times.

    Parameters
    ----------
    source, target : (boundary,) float
        Times in s that never decrease and mean the same in both recordings.
    rate : float
        Frames per second of both views.
    frames : (int, int)
        Length of each view.
    whole : bool
        Whether the ends of both views correspond too.

    Returns
    -------
    (step, 2) int
        Frames of source and target.

    Raises
    ------
    AlignmentError
        For fewer than two boundaries, other numbers of them, or times that decrease.
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
