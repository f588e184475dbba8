"""The result of an alignment, and checks of what can be aligned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.errors import AlignmentError
from elocute.one_line_repr import one_line

WarpingPath = NDArray[np.intp]
Views = tuple[Float32Array, ...]
"""Sequences (frame, feature) of the same thing, to be aligned with each other: two or more."""

CELLS_MAX = 64_000_000
"""Cells of one matrix of costs: 8,000 against 8,000 frames take half a gigabyte."""
COLUMN_TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False)
class Alignment:
    """Sequences warped onto each other.

    Parameters
    ----------
    features
        Of each view, (frame, feature), as the method compared them.
    path
        (step, view): frames that belong together; no column ever decreases. Where `whole`, every
        column goes from the first frame to the last; otherwise the first view, in which the others
        were to be found, may begin and end anywhere.
    score
        0 to 1, higher is better: mean correlation of the compared features along the path.
    attention
        (source frame, target frame), columns sum to one; None where a method has none, and for
        three or more views.
    whole
        False where the ends of the first view are free.
    posterior
        (source frame, target frame), columns sum to one: how probably frames belong together, of a
        method that reads its path by soft-DTW. It is no attention: distances of features are all
        that it knows.

    Raises
    ------
    AlignmentError
        Where these do not fit together.
    """

    features: Views
    path: WarpingPath
    score: float
    attention: Float32Array | None = None
    whole: bool = True
    posterior: Float32Array | None = None

    __repr__ = one_line

    def __post_init__(self) -> None:
        path = np.ascontiguousarray(self.path, np.intp)
        check_path(path, [len(view) for view in self.features], self.whole)
        if not 0 <= self.score <= 1:
            raise AlignmentError.about("score", found=f"{self.score}", allowed="0 to 1")
        for name in ("attention", "posterior"):
            weights = getattr(self, name)
            if weights is not None:
                _check_columns(weights, [len(view) for view in self.features[:2]], name)
        object.__setattr__(self, "path", path)

    def source_frames(self) -> NDArray[np.float64]:
        """(target frame,): the source frame of each target frame, the mean where there are many."""
        targets = self.path[:, 1]
        sums = np.bincount(targets, self.path[:, 0], minlength=targets.max() + 1)
        return sums / np.maximum(np.bincount(targets, minlength=len(sums)), 1)


def check_path(path: WarpingPath, lengths: Sequence[int], whole: bool = True) -> None:
    """Raise AlignmentError for an array that is not a path of views of these lengths."""
    fault = ""
    if path.ndim != 2 or not len(path) or path.shape[1] != len(lengths):
        fault = f"shape {path.shape}"
    elif (np.diff(path, axis=0) < 0).any() or (path < 0).any() or (path >= lengths).any():
        fault = "going back, or beyond the end"
    else:
        first = 0 if whole else 1
        ends = np.array(lengths) - 1
        if (path[0, first:] != 0).any() or (path[-1, first:] != ends[first:]).any():
            fault = f"from {path[0].tolist()} to {path[-1].tolist()}"
    if fault:
        raise AlignmentError.about(
            "path", found=fault, allowed=f"(step, {len(lengths)}), from 0 to the last frame"
        )


def _check_columns(weights: Float32Array, lengths: Sequence[int], name: str) -> None:
    sums = weights.sum(axis=0, dtype=np.float64) if weights.ndim == 2 else np.zeros(1)
    if weights.shape != tuple(lengths) or np.abs(sums - 1).max() > COLUMN_TOLERANCE:
        raise AlignmentError.about(
            name,
            found=f"shape {weights.shape}, columns {sums.min():g} to {sums.max():g}",
            allowed=f"{tuple(lengths)}, columns that sum to one",
        )


def check_views(views: Sequence[object], same_width: bool, subject: str = "views") -> Views:
    """Views as float32 arrays. Raises AlignmentError for views that no method can align."""
    if len(views) < 2:
        raise AlignmentError.about(subject, found=f"{len(views)}", allowed="two or more sequences")
    group = tuple(_checked(view, f"{subject}[{place}]") for place, view in enumerate(views))
    widths = {view.shape[1] for view in group}
    if same_width and len(widths) > 1:
        raise AlignmentError.about(
            subject,
            found=f"{' and '.join(map(str, sorted(widths)))} features",
            allowed="equal counts with this method",
            remedy="use ctw, dctw, cca-soft or dcaw",
        )
    for one, other in pairwise(sorted(map(len, group))):
        if one * other > CELLS_MAX:
            raise AlignmentError.about(
                subject,
                found=f"{one} against {other} frames",
                allowed=f"{CELLS_MAX / 1e6:g} million cells",
                remedy="cut them into words",
            )
    return group


def _checked(view: object, subject: str) -> Float32Array:
    try:
        values = np.ascontiguousarray(view, np.float32)  # pyright: ignore[reportCallIssue, reportArgumentType]
    except (TypeError, ValueError) as error:
        raise AlignmentError.about(subject, found="not an array of numbers") from error
    allowed = "(frame, feature), at least one of each, finite"
    if values.ndim != 2 or not values.size:
        raise AlignmentError.about(subject, found=f"shape {values.shape}", allowed=allowed)
    wrong = ~np.isfinite(values).all(axis=1)
    if wrong.any():
        raise AlignmentError.about(
            subject, found=f"NaN or infinity in frame {int(wrong.argmax())}", allowed=allowed
        )
    return values
