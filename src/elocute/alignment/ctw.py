"""Canonical time warping (Zhou & de la Torre 2009; many sequences: 2016).

Alternates between DTW of projected views and CCA of views warped so, until no path changes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from elocute.alignment.aligner import DtwAligner, Embedded
from elocute.alignment.alignment import Array, Group, Path
from elocute.alignment.cca import Projection, canonical, principal
from elocute.alignment.config import CtwConfig, PlainConfig
from elocute.alignment.warping_paths import diagonal_path
from elocute.errors import AlignmentError


class CtwAligner(DtwAligner):
    """DTW of projections learned over all pairs."""

    def __init__(self, config: PlainConfig, projections: Sequence[Projection], widths) -> None:
        super().__init__(config)
        self.projections = tuple(projections)
        self.widths = tuple(widths)

    def embed(self, view: Array, side: int) -> Embedded:
        return Embedded(self.projections[side](view))


def fit_ctw(groups: Sequence[Group], config: CtwConfig) -> CtwAligner:
    """Projections of each view, from all groups (pairs, or more views) at once."""
    widths = tuple(view.shape[1] for view in groups[0])
    shared = is_shared(config.shared, widths)
    basis = side_bases(groups, config.energy, shared)
    reduced = [tuple(basis[k](view) for k, view in enumerate(group)) for group in groups]
    paths = first_paths(groups, config)
    aligner = CtwAligner(config, basis, widths)
    for _ in range(config.rounds):
        found = canonical_of(reduced, paths, config.dimensions, config.ridge, shared)
        joined = [chained(one, other) for one, other in zip(basis, found, strict=True)]
        aligner = CtwAligner(config, joined, widths)
        before, paths = paths, [each.path for each in aligner.align_all(groups)]
        if all(np.array_equal(a, b) for a, b in zip(before, paths, strict=True)):
            break
    return aligner


def is_shared(wanted: bool | None, widths: Sequence[int]) -> bool:
    """Whether views are of one kind. Raises AlignmentError where they cannot be."""
    same = len(set(widths)) == 1
    if wanted and not same:
        raise AlignmentError.about(
            "shared", found=f"{tuple(widths)} features", allowed="equal ones"
        )
    return same if wanted is None else wanted


def side_bases(groups: Sequence[Group], energy: float, shared: bool) -> list[Projection]:
    """Principal components of each view over all groups, or of all views together."""
    sides = [[group[k] for group in groups] for k in range(len(groups[0]))]
    if shared:
        return [principal([view for side in sides for view in side], energy)] * len(sides)
    return [principal(side, energy) for side in sides]


def first_paths(groups: Sequence[Group], config: PlainConfig) -> list[Path]:
    """DTW where views are of one kind; in proportion where they cannot be compared."""
    if len({view.shape[1] for view in groups[0]}) == 1:
        return [each.path for each in DtwAligner(config).align_all(groups)]
    return [
        np.stack([diagonal_path(len(view), max(map(len, group)))[:, 0] for view in group], axis=1)
        for group in groups
    ]


def canonical_of(
    groups: Sequence[Group], paths: Sequence[Path], dimensions: int, ridge: float, shared: bool
) -> tuple[Projection, ...]:
    """CCA of all groups' views, warped by their paths; one projection for all where shared."""
    count = len(groups[0])
    sides = [
        np.concatenate([g[k][p[:, k]] for g, p in zip(groups, paths, strict=True)])
        for k in range(count)
    ]
    if not shared:
        return canonical([side.astype(np.float64) for side in sides], dimensions, ridge)
    # Every ordered pair of views, so that both have the same statistics.
    pairs = [(i, j) for i in range(count) for j in range(count) if i != j]
    one = np.concatenate([sides[i] for i, _ in pairs]).astype(np.float64)
    other = np.concatenate([sides[j] for _, j in pairs]).astype(np.float64)
    return (canonical([one, other], dimensions, ridge)[0],) * count


def chained(first: Projection, second: Projection) -> Projection:
    """One projection that is both, one after the other."""
    return Projection(
        first.mean + second.mean @ np.linalg.pinv(first.directions),
        first.directions @ second.directions,
    )
