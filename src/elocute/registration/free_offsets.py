"""Free offsets: the skin leaves the model where the scan does, smoothly.

The last stage of VOCA's registration (2019, section 6, after Li et al. 2017): the distance from
the scan to the surface plus the bending of what is added to the model. Targets lie along the
surface's normal, so all three coordinates share one sparse matrix of a row per vertex; a step
along the tangent is neither asked for nor forbidden (a majorisation of point-to-plane).

What a scan hardly shows moves with what it shows: eyes with their lids, teeth with the lips.
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

    bend_m: length over which offsets may bend: shorter follows more detail, and more noise.
    stretch_m: length over which they may change at all; keeps unseen parts quiet. anchor: share of
    the area by which an offset is drawn back to the model. reach_m, facing: as for
    `find_correspondences`.
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
    """(vertex, 3) m from the model to the scan, smooth, zero off the skin (VOCA 2019, section 6).

    model: (vertex, 3) m, fitted, in the scan's frame. start: offsets (vertex, 3) m of the frame
    before, posed as this one. stages: coarse to fine.
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


SIDES = ("left", "right")
MOUTH_PARTS = ("teeth", "gums", "tongue")
SEATING_STEPS = 8
SEATING_PRIOR = 0.02
"""Weight, relative to a vertex of the lids, by which an eye keeps to the mean move around it."""


def carry_inner_parts(
    template: Template, before: Float64Array, after: Float64Array
) -> Float64Array:
    """Eyes and the inside of the mouth moved along with a skin that was registered.

    An eye keeps its distance from each place on its lids, as well as one ball can; teeth, gums and
    tongue keep to each other and move as the lips do. before, after: (vertex, 3) m, the model,
    whole, and what became of it, where only the skin has moved; the result is as `after`. A head
    without the regions is left as it is.
    """
    regions, result = template.head.regions, after.copy()
    moved = after - before
    for side in SIDES:
        eye = regions.get(f"eye_{side}")
        lids = [regions.get(f"lid_{part}_{side}") for part in ("upper", "lower")]
        if eye is None or any(lid is None for lid in lids):
            continue
        rim = np.concatenate([lid for lid in lids if lid is not None])
        result[eye] = before[eye] + _seated(before[eye], before[rim], after[rim])
    lips = regions.get("lips")
    parts = [regions[name] for name in MOUTH_PARTS if name in regions]
    if lips is not None and parts:
        inside = np.concatenate(parts)
        result[inside] = before[inside] + moved[lips].mean(axis=0)
    return result


def _seated(eye: Float64Array, before: Float64Array, after: Float64Array) -> Float64Array:
    """(3,) m: how far a ball moves so that its middle is as far from the lids as it was."""
    middle = (eye.max(axis=0) + eye.min(axis=0)) / 2
    apart = np.linalg.norm(before - middle, axis=1)
    carried = (after - before).mean(axis=0)
    shift = carried.copy()
    for _ in range(SEATING_STEPS):
        away = middle + shift - after
        length = np.maximum(np.linalg.norm(away, axis=1), 1e-9)
        slopes = away / length[:, None]
        prior = SEATING_PRIOR * len(after)
        gram = slopes.T @ slopes + prior * np.eye(3)
        shift = shift + np.linalg.solve(
            gram, slopes.T @ (apart - length) + prior * (carried - shift)
        )
    return shift
