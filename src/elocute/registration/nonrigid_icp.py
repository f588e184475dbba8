"""Optimal step non-rigid ICP (Amberg, Romdhani and Vetter 2007), fast on sparse matrices.

Every vertex of the template has an affine map X (4, 3) of its own; neighbours' maps are held
alike by a stiffness that falls from level to level:

    E(X) = Σ w_i |X_iᵀ v_i - u_i|² + α Σ_edges |(X_i - X_j)ᵀ G|² + β Σ_landmarks |X_lᵀ v_l - p_l|²

The matrix changes from step to step only where matches come and go. So it is factorised once per
stiffness and person, and that factor, a little out of date, preconditions conjugate gradients,
which then need a handful of steps. The second frame of a person pays for no factorisation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.head.normals import vertex_normals
from elocute.numerics.rigid_alignment import rigid_alignment
from elocute.numerics.sparse_factor import factor_of
from elocute.registration.closest_points import DenseMesh
from elocute.registration.correspondences import robust_weights
from elocute.registration.landmarks import Landmarks
from elocute.registration.scan import Scan
from elocute.registration.template import Template

CONVERGED = 5e-2  # share of the first residual at which conjugate gradients stop
ACCEPTED = 0.3  # share at which a solution may be used where that takes too long
CG_STEPS_MAX = 12
"""Steps of conjugate gradients beyond which a new factorisation is cheaper."""


@dataclass(frozen=True)
class StiffnessLevel:
    """Settings of one level.

    alpha: weight of the edges, α; coordinates are scaled to a head of size one. landmarks: weight
    of the landmarks, β. steps: the most steps. settled: mean movement in m below which the level is
    done. reach_m, facing: as for `find_correspondences`.
    """

    alpha: float
    landmarks: float
    steps: int = 4
    settled: float = 5e-5
    reach_m: float = 0.02
    facing: float = 0.6


COLD_LEVELS = (
    StiffnessLevel(10.0, 10.0),
    StiffnessLevel(2.0, 5.0),
    StiffnessLevel(0.3, 2.0, reach_m=0.01),
    StiffnessLevel(0.03, 0.3, reach_m=0.006),
    StiffnessLevel(0.01, 0.05, reach_m=0.004),
)
"""From a template that stands roughly where the scan does."""
WARM_LEVELS = (
    StiffnessLevel(0.3, 2.0, 1, reach_m=0.01),
    StiffnessLevel(0.03, 0.3, 1, reach_m=0.006),
    StiffnessLevel(0.01, 0.05, 2, reach_m=0.004),
)
"""From the shape of the frame before."""
RIM_STIFFNESS, RIM_M = 10.0, 0.004
"""How much stiffer the skin is on the rims of the lids and inside the mouth, and how far that
reaches: there a scan shows eyes and teeth, or nothing, and the nearest point is no match."""
RIM_MATCHED = 0.5
EYE_AREAS, SOCKET_OCCLUSION = ("eye_area_left", "eye_area_right"), 0.6
"""Where these are darker, they line the sockets behind the lids, which no scan shows."""
LANDMARK_NOISE_M = 0.002
NOWHERE = np.zeros(0, np.int32)
LIDS = ("lid_upper_left", "lid_upper_right", "lid_lower_left", "lid_lower_right")


@dataclass(frozen=True, eq=False)
class _AlignedScan:
    """A scan in the frame of the head: surface, normals (point, 3), rims (point,), landmarks."""

    surface: DenseMesh
    normals: Float64Array
    boundary: NDArray[np.bool_]
    landmarks: Landmarks


@dataclass(frozen=True, eq=False)
class NonrigidIcp:
    """Non-rigid ICP of one template's skin; keeps its factorisations from scan to scan."""

    template: Template
    factors: dict[float, Any] = field(default_factory=dict, repr=False)

    @cached_property
    def _triangles(self) -> NDArray[np.intp]:
        triangles = self.template.skin_index[self.template.head.triangles]
        return triangles[(triangles >= 0).all(axis=1)]

    @cached_property
    def _scale(self) -> float:
        """Heads per metre."""
        return 1 / float(np.ptp(self.template.vertices[self.template.skin], axis=0).max())

    @cached_property
    def _edges(self) -> Any:
        """(4 · free, 4 · free) MᵀM ⊗ GᵀG with γ = 1, as the paper has it for one unit of size."""
        from scipy.sparse import coo_matrix, diags, identity, kron

        count = len(self.template.skin)
        a, b, c = self._triangles.T
        rows, columns = np.r_[a, b, c], np.r_[b, c, a]
        stiffness = 1 + (RIM_STIFFNESS - 1) * self._rim_share
        weights = np.maximum(stiffness[rows], stiffness[columns])
        links = coo_matrix((weights, (rows, columns)), (count, count)).tocsr()
        links = links.maximum(links.T)
        laplacian = diags(np.asarray(links.sum(axis=1)).ravel()) - links
        return kron(laplacian, identity(4), format="csr")

    @cached_property
    def _rim_share(self) -> Float64Array:
        """(free,) 1 on the rims of the lids, behind them and inside the mouth, 0 on open skin."""
        from scipy.spatial import KDTree

        head, skin = self.template.head, self.template.vertices[self.template.skin]
        share = np.zeros(head.vertex_count)
        share[head.regions.get("inner_mouth", NOWHERE)] = 1
        for name in EYE_AREAS:
            area = head.regions.get(name, NOWHERE)
            share[area[head.occlusion[area] < SOCKET_OCCLUSION]] = 1
        share = share[self.template.skin]
        rims = np.concatenate([head.regions.get(name, NOWHERE) for name in LIDS])
        if len(rims):
            apart, _ = KDTree(self.template.vertices[rims]).query(skin)
            share = np.maximum(share, np.exp(-np.square(apart / RIM_M)))
        return share

    @cached_property
    def _matchable(self) -> NDArray[np.bool_]:
        """(free,) vertices that a scan can show, where what is nearest is what they are."""
        return self._rim_share < RIM_MATCHED

    def register(
        self,
        start: Float64Array,
        scan: Scan,
        landmarks: Landmarks,
        levels: Sequence[StiffnessLevel] = COLD_LEVELS,
    ) -> tuple[Float64Array, int]:
        """Lay the template over a scan: vertices (vertex, 3) m, and how many steps that took.

        Only the skin moves (not eyes, teeth and tongue). start: (vertex, 3) m, the template in the
        scan's frame: fixed, adapted by Eq. 1 of "Speech in the wild" (2019), or the frame before.
        Points on the rims of the scan's holes are not matched. levels: stiff to soft.
        """
        skin = self.template.skin
        # In the frame of the head the matrix is nearly the same for all frames of a person.
        rotation, shift = rigid_alignment(self.template.vertices[skin], start[skin])
        aim = _AlignedScan(
            DenseMesh((scan.points - shift) @ rotation, scan.triangles),
            scan.normals @ rotation,
            scan.boundary,
            Landmarks((landmarks.points - shift) @ rotation, landmarks.confidence),
        )
        current, steps = (start[skin] - shift) @ rotation, 0
        middle = self.template.vertices[skin].mean(axis=0)
        source = np.column_stack([(current - middle) * self._scale, np.ones(len(skin))])
        maps = np.tile(np.vstack([np.eye(3), np.zeros((1, 3))]), (len(skin), 1, 1))
        for level in levels:
            for _ in range(level.steps):
                weights, targets = self._targets(current, aim, level)
                scaled = (targets - middle) * self._scale
                maps = self._solved(level.alpha, source, weights, scaled, maps)
                moved = np.einsum("va,vab->vb", source, maps) / self._scale + middle
                change = float(np.linalg.norm(moved - current, axis=1).mean())
                current, steps = moved, steps + 1
                if change < level.settled:
                    break
        result = start.copy()
        result[skin] = current @ rotation.T + shift
        return result, steps

    def _targets(
        self, current: Float64Array, aim: _AlignedScan, level: StiffnessLevel
    ) -> tuple[Float64Array, Float64Array]:
        """Weights (free,) and targets (free, 3) m: closest points, combined with landmarks.

        No match across a hole's rim, beyond reach, or between surfaces that face apart (4.3).
        """
        nearest = aim.surface.closest(current, level.reach_m)
        corners = aim.surface.triangles[nearest.triangle]
        normals = vertex_normals(current, self._triangles)
        shared = np.einsum("vc,vca->va", nearest.bary, aim.normals[corners])
        length = np.maximum(np.linalg.norm(shared, axis=1), 1e-12)
        facing = np.einsum("va,va->v", normals, shared) / length
        kept = np.isfinite(nearest.squared) & (nearest.squared <= level.reach_m**2)
        kept &= (facing > level.facing) & self._matchable
        kept &= ~aim.boundary[corners].any(axis=1)
        weights = kept.astype(np.float64)
        targets = np.where(kept[:, None], nearest.points, 0)
        if level.landmarks:
            vertices, places, shares = self.template.landmark_weights(aim.landmarks)
            rows = self.template.skin_index[vertices]
            off = np.linalg.norm(places - current[rows], axis=1)
            pull = level.landmarks * shares * robust_weights(off, LANDMARK_NOISE_M)
            total = weights[rows] + pull
            targets[rows] = (
                weights[rows, None] * targets[rows] + pull[:, None] * places
            ) / np.maximum(total, 1e-12)[:, None]
            weights[rows] = total
        return weights, targets

    def _solved(
        self,
        alpha: float,
        source: Float64Array,
        weights: Float64Array,
        aims: Float64Array,
        maps: Float64Array,
    ) -> Float64Array:
        """(free, 4, 3): the maps that minimise E for given matches."""
        from scipy.sparse import bsr_matrix

        count = len(source)
        blocks = weights[:, None, None] * source[:, :, None] * source[:, None, :]
        # A trace of regularisation for vertices cut off from every match.
        blocks = blocks + 1e-9 * np.eye(4)
        data = bsr_matrix((blocks, np.arange(count), np.arange(count + 1)))
        matrix = (alpha * self._edges + data.tocsr()).tocsr()
        side = (weights[:, None, None] * source[:, :, None] * aims[:, None, :]).reshape(-1, 3)
        guess = maps.reshape(-1, 3)
        if alpha in self.factors:
            solution = _conjugate(matrix, side, guess, self.factors[alpha])
            if solution is not None:
                return solution.reshape(-1, 4, 3)
        self.factors[alpha] = factor_of(matrix.tocsc())
        return self.factors[alpha].solve(side).reshape(-1, 4, 3)


def _conjugate(
    matrix: Any, side: Float64Array, guess: Float64Array, factor: Any
) -> Float64Array | None:
    """x of matrix · x = side (row, column) by preconditioned conjugate gradients.

    None where a dozen steps come to nothing: the factor is then too old.
    """
    x = guess.copy()
    left = side - matrix @ x
    first = np.linalg.norm(left, axis=0) + 1e-9
    near = factor.solve(left)
    along, power = near.copy(), (left * near).sum(axis=0)
    for _ in range(CG_STEPS_MAX):
        if (np.linalg.norm(left, axis=0) <= CONVERGED * first).all():
            return x
        image = matrix @ along
        step = power / np.maximum((along * image).sum(axis=0), 1e-300)
        x += step * along
        left -= step * image
        near = factor.solve(left)
        before, power = power, (left * near).sum(axis=0)
        along = near + power / np.maximum(before, 1e-300) * along
    # The next matches correct what is left of a solution that is nearly there.
    return x if (np.linalg.norm(left, axis=0) <= ACCEPTED * first).all() else None
