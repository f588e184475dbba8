"""Canonical time warping (Zhou & de la Torre 2009; many sequences: 2016).

Alternates between DTW of projected views and CCA of views warped so, until no path changes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from elocute.alignment.aligner import Aligner, dtw_aligner, projected_aligner
from elocute.alignment.alignment import Views, WarpingPath
from elocute.alignment.cca import LinearProjection, canonical_projections, principal_projection
from elocute.alignment.dtw import diagonal_path
from elocute.alignment.settings import CtwConfig, DtwConfig
from elocute.errors import AlignmentError


def fit_ctw(groups: Sequence[Views], config: CtwConfig) -> Aligner:
    """DTW of projections of each view, learned from all groups (pairs, or more views) at once."""
    widths = tuple(view.shape[1] for view in groups[0])
    return projected_aligner(config, fit_projections(groups, config), widths)


def fit_projections(groups: Sequence[Views], config: CtwConfig) -> list[LinearProjection]:
    """A projection of each view: paths and CCA in turn, until no path changes."""
    widths = tuple(view.shape[1] for view in groups[0])
    shared = is_shared(config.shared, widths)
    basis = view_bases(groups, config.energy, shared)
    reduced = [tuple(basis[k](view) for k, view in enumerate(group)) for group in groups]
    paths = initial_paths(groups, config)
    projections = basis
    for _ in range(config.rounds):
        canonical = canonical_along_paths(reduced, paths, config.dimensions, config.ridge, shared)
        projections = [one.then(other) for one, other in zip(basis, canonical, strict=True)]
        aligner = projected_aligner(config, projections, widths)
        before, paths = paths, [each.path for each in aligner.align_all(groups)]
        if all(np.array_equal(a, b) for a, b in zip(before, paths, strict=True)):
            break
    return projections


def is_shared(wanted: bool | None, widths: Sequence[int]) -> bool:
    """Whether views are of one kind. Raises AlignmentError where they cannot be."""
    same = len(set(widths)) == 1
    if wanted and not same:
        raise AlignmentError.about(
            "shared", found=f"{tuple(widths)} features", allowed="equal ones"
        )
    return same if wanted is None else wanted


def view_bases(groups: Sequence[Views], energy: float, shared: bool) -> list[LinearProjection]:
    """Principal components of each view over all groups, or of all views together."""
    sides = [[group[k] for group in groups] for k in range(len(groups[0]))]
    if shared:
        return [principal_projection([view for side in sides for view in side], energy)] * len(
            sides
        )
    return [principal_projection(side, energy) for side in sides]


def initial_paths(groups: Sequence[Views], config: CtwConfig) -> list[WarpingPath]:
    """DTW where views are of one kind; in proportion where they cannot be compared."""
    if len({view.shape[1] for view in groups[0]}) == 1:
        plain = DtwConfig(
            band=config.band, open_source=config.open_source, softness=config.softness
        )
        return [each.path for each in dtw_aligner(plain).align_all(groups)]
    return [
        np.stack([diagonal_path(len(view), max(map(len, group)))[:, 0] for view in group], axis=1)
        for group in groups
    ]


def canonical_along_paths(
    groups: Sequence[Views],
    paths: Sequence[WarpingPath],
    dimensions: int,
    ridge: float,
    shared: bool,
) -> tuple[LinearProjection, ...]:
    """CCA of all groups' views, warped by their paths; one projection for all where shared."""
    count = len(groups[0])
    sides = [
        np.concatenate([g[k][p[:, k]] for g, p in zip(groups, paths, strict=True)])
        for k in range(count)
    ]
    if not shared:
        return canonical_projections([side.astype(np.float64) for side in sides], dimensions, ridge)
    # Every ordered pair of views, so that both have the same statistics.
    pairs = [(i, j) for i in range(count) for j in range(count) if i != j]
    one = np.concatenate([sides[i] for i, _ in pairs]).astype(np.float64)
    other = np.concatenate([sides[j] for _, j in pairs]).astype(np.float64)
    return (canonical_projections([one, other], dimensions, ridge)[0],) * count
