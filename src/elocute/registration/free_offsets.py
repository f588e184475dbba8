"""Free offsets: the skin leaves the model where the scan does, smoothly.

The last stage of VOCA's registration (2019, section 6, after Li et al. 2017): the distance from
the scan to the surface plus the bending of what is added to the model. Targets lie along the
surface's normal, so all three coordinates share one sparse matrix of a row per vertex; a step
along the tangent is neither asked for nor forbidden (a majorisation of point-to-plane).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from elocute.array_types import Float64Array
from elocute.numerics.sparse_factor import factor_of
from elocute.registration.correspondences import (
    Correspondences,
    ScanSamples,
    find_correspondences,
    robust_weights,
)
from elocute.registration.template import Template

NOISE_M = 2e-4


@dataclass(frozen=True)
class OffsetStage:
    """Settings of one step towards the scan.

    Attributes
    ----------
    bend_m
        Length over which offsets may bend: shorter follows more detail, and more noise.
    stretch_m
        Length over which they may change at all; keeps unseen parts quiet.
    anchor
        Share of the area by which an offset is drawn back to the model.
    reach_m
        The largest distance of a correspondence.
    facing
        The smallest cosine between the normals of a correspondence.
    """

    bend_m: float
    stretch_m: float = 3e-4
    anchor: float = 1e-3
    reach_m: float = 0.004
    facing: float = 0.6


COLD_STAGES = (
    OffsetStage(0.008, reach_m=0.006),
    OffsetStage(0.004),
    OffsetStage(0.003, reach_m=0.003),
)
FINE_STAGES = (OffsetStage(0.004, anchor=0.0), OffsetStage(0.003, anchor=0.0, reach_m=0.003))
"""From a surface that has left the model already, to which nothing is drawn back."""
WARM_STAGES = (OffsetStage(0.004), OffsetStage(0.003, reach_m=0.003))


def fit_offsets(
    template: Template,
    model: Float64Array,
    samples: ScanSamples,
    *,
    start: Float64Array | None = None,
    stages: Sequence[OffsetStage] = COLD_STAGES,
) -> Float64Array:
    """Smooth offsets from the model to the scan (VOCA 2019, section 6).

    Parameters
    ----------
    template
        Its skin may move.
    model
        (vertex, 3) m, the fitted model in the scan's frame.
    samples
        Of the scan.
    start
        Offsets (vertex, 3) m of the frame before, posed as this one.
    stages
        Settings, coarse to fine.

    Returns
    -------
    (vertex, 3) m to be added to the model; zero off the skin.
    """
    offsets = np.zeros_like(model) if start is None else start.copy()
    for stage in stages:
        matched = find_correspondences(
            template, model + offsets, samples, reach_m=stage.reach_m, facing=stage.facing
        )
        offsets[template.skin] += _change(template, offsets[template.skin], matched, samples, stage)
    return offsets


def _change(
    template: Template,
    offsets: Float64Array,
    matched: Correspondences,
    samples: ScanSamples,
    stage: OffsetStage,
) -> Float64Array:
    """(free, 3) m: the best change of offsets (free, 3) m for given correspondences."""
    from scipy.sparse import csr_matrix, diags

    corners = template.skin_index[template.triangles[matched.triangle]]
    rows = np.flatnonzero((corners >= 0).all(axis=1))
    weights = robust_weights(matched.gap[rows], NOISE_M) * samples.areas[matched.sample[rows]]
    starts = 3 * np.arange(len(rows) + 1)
    spread: Any = csr_matrix(
        (matched.bary[rows].ravel(), corners[rows].ravel(), starts), (len(rows), len(offsets))
    )
    smooth = stage.bend_m**4 * template.bend_matrix + stage.stretch_m**2 * template.stretch_matrix
    smooth = smooth + diags(stage.anchor * template.skin_areas)
    weighted = spread.T @ diags(weights)
    target = matched.gap[rows, None] * matched.normals[rows]
    factor = factor_of((weighted @ spread + smooth).tocsc())
    return factor.solve(weighted @ target - smooth @ offsets)
