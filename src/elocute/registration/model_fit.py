"""Identity, expression and pose of a head by regularised least squares on a scan.

The model stage of VOCA's capture section (2019, section 6), which follows Li et al. 2017 (FLAME):
the distance from the scan to the model's surface, a term for landmarks, ridge on coefficients.
Gauss-Newton on point-to-plane distances; each step finds its matches anew.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.head.skinning import joint_transforms
from elocute.motion.joint_jacobians import Rig, joint_slopes, vertex_transforms
from elocute.numerics.bounded_least_squares import solve_box
from elocute.numerics.quaternions import from_axis_angle, multiply, to_axis_angle
from elocute.registration.correspondences import (
    Correspondences,
    ScanSamples,
    find_correspondences,
    robust_weights,
)
from elocute.registration.landmarks import Landmarks
from elocute.registration.template import Template
from elocute.registration.zero_pose import HeadPose, posed_joints

MM = 1000.0
NOISE_M = 1e-4
"""Smallest scale of the robust weights: about a scanner's noise."""
NECK_COST = 1.0
"""Cost of a squared radian of the neck and of the head on it, in mm² of mean squared distance: the
root turns the whole head, and a face cropped at the chin says nothing about its neck."""
LANDMARK_NOISE_M = 0.002
"""Smallest scale of the robust weights of landmarks: nobody points at a lip more exactly."""
UNSEEN_SHAPES = re.compile(r"eyeLook|tongue")
"""Expressions that a resting face does not show: gaze and tongue are inside, and hardly scanned."""
UNSEEN_COST = 1e3
"""Cost of their squared weights at rest, relative to that of others."""
BLINKS = re.compile(r"eyeBlink")
BLINK_COST = 0.02
"""The same of blinks: people close their eyes in a scanner, and no identity has them closed."""


@dataclass(frozen=True, eq=False)
class ModelParameters:
    """The head model fitted to one scan.

    identity: (identity,) standard deviations; (0,) where the face is known. expression:
    (expression,) weights. pose: where the head stands.
    """

    identity: Float64Array
    expression: Float64Array
    pose: HeadPose

    @property
    def deviation(self) -> float:
        """Root mean square of the identity, standard deviations; 0 where the face is known."""
        return float(np.sqrt(np.mean(self.identity**2))) if len(self.identity) else 0.0


@dataclass(frozen=True)
class FitStage:
    """Some iterations of the fit with the same settings.

    reach_m, facing: as for `find_correspondences`. landmarks: weight of the mean squared landmark
    distance relative to the surface's. identity, expression: cost of a squared coefficient in mm²
    of mean squared distance. trusted_m: landmarks further off than this (root mean square) weigh
    less by the square, as noise of that size does in least squares: once a known face is near, it
    is more accurate than a landmark detector. A face that is not known yet is off for another
    reason.
    """

    steps: int
    reach_m: float
    facing: float
    landmarks: float
    identity: float = 2e-3
    expression: float = 2e-3
    trusted_m: float = np.inf


TRUSTED_LANDMARKS_M = 0.0015
COLD_STAGES = (
    FitStage(3, 0.03, 0.3, 1.0, 0.2, 0.2),
    FitStage(4, 0.015, 0.4, 0.1, 0.02, 0.02),
    FitStage(4, 0.006, 0.5, 0.01, trusted_m=TRUSTED_LANDMARKS_M),
    FitStage(3, 0.003, 0.6, 0.003, 5e-4, 5e-4, TRUSTED_LANDMARKS_M),
)
"""A known face, from landmarks alone."""
NEUTRAL_STAGES = (
    FitStage(3, 0.03, 0.3, 1.0, 0.2, 1.0),
    FitStage(4, 0.015, 0.4, 0.3, 0.05, 0.5),
    FitStage(4, 0.006, 0.5, 0.1, 0.02, 0.2),
    FitStage(6, 0.003, 0.6, 0.1, 5e-4, 0.2),
)
"""A face of unknown identity at rest. Its expression is stiff: it must not explain the identity."""

WARM_STAGES = (
    FitStage(3, 0.006, 0.5, 0.01, trusted_m=TRUSTED_LANDMARKS_M),
    FitStage(2, 0.003, 0.6, 0.003, 5e-4, 5e-4, TRUSTED_LANDMARKS_M),
)
"""From the frame before."""
BOUNDS = (-0.25, 1.25)
"""Of the weight of a shape made for weights from 0 to 1 (ARKit's); others are unbounded."""
IDENTITY_BOUND = 2.5
"""Standard deviations: nobody is further from the mean. What lies beyond shows as a face that is
unlike any, instead of being explained by one that nobody has."""


@dataclass(frozen=True, eq=False)
class ModelFit:
    """Gauss-Newton fit of a template's identity (where wanted), expression and pose."""

    template: Template
    with_identity: bool

    @property
    def basis(self) -> Float64Array:
        """(identity + expression, vertex · 3)."""
        parts = [self.template.basis]
        if self.with_identity:
            parts.insert(0, self.template.identity_basis)
        return np.concatenate(parts).reshape(sum(map(len, parts)), -1)

    @property
    def cold_stages(self) -> tuple[FitStage, ...]:
        """From scratch: of a face that is sought with its identity, or of a known one."""
        return NEUTRAL_STAGES if self.with_identity else COLD_STAGES

    def neutral_start(self, pose: HeadPose) -> ModelParameters:
        """The template itself at a pose."""
        count = len(self.template.identity_basis) if self.with_identity else 0
        return ModelParameters(np.zeros(count), np.zeros(len(self.template.basis)), pose)

    def joints(self, parameters: ModelParameters) -> Float64Array:
        """(joint, 3) m of this identity."""
        head = self.template.head
        return head.identity_joints(parameters.identity.astype(np.float32)).astype(np.float64)

    def zero_pose_vertices(self, parameters: ModelParameters) -> Float64Array:
        """(vertex, 3) m in zero pose."""
        head = self.template
        moved = np.tensordot(parameters.expression, head.basis, 1)
        if len(parameters.identity):
            moved = moved + np.tensordot(parameters.identity, head.identity_basis, 1)
        return head.vertices + moved

    def posed_vertices(self, parameters: ModelParameters) -> Float64Array:
        """(vertex, 3) m in the scan's frame."""
        matrices, shifts = vertex_transforms(self._rig(parameters), parameters.pose.turns)
        moved = np.einsum("vab,vb->va", matrices, self.zero_pose_vertices(parameters)) + shifts
        return moved + parameters.pose.translation

    def _rig(self, parameters: ModelParameters) -> Rig:
        head = self.template.head
        return Rig(
            self.joints(parameters), head.joint_parents, head.skin_weights.astype(np.float64)
        )

    def fit(
        self,
        samples: ScanSamples,
        landmarks: Landmarks,
        start: ModelParameters,
        stages: Sequence[FitStage] = COLD_STAGES,
    ) -> ModelParameters:
        """The parameters nearest to samples and to landmarks in their frame, of which none need be
        good.

        start: parameters near the result. stages: coarse to fine.
        """
        basis = np.ascontiguousarray(self.basis.T)
        parameters = start
        for stage in stages:
            for _ in range(stage.steps):
                parameters = self._step(samples, landmarks, parameters, stage, basis)
        return parameters

    def _step(
        self,
        samples: ScanSamples,
        landmarks: Landmarks,
        parameters: ModelParameters,
        stage: FitStage,
        basis: Float64Array,
    ) -> ModelParameters:
        posed = self.posed_vertices(parameters)
        matched = find_correspondences(
            self.template, posed, samples, reach_m=stage.reach_m, facing=stage.facing, near=1
        )
        weights = robust_weights(matched.gap, NOISE_M)
        slopes = self._surface_slopes(matched, parameters, basis)
        total = max(float(weights.sum()), 1e-9)
        # With few correspondences landmarks count for more.
        scaled = MM * slopes * np.sqrt(weights / total)[:, None]
        left = MM * matched.gap * np.sqrt(weights / total)
        gram, side = scaled.T @ scaled, scaled.T @ left
        if stage.landmarks:
            self._add_landmarks(gram, side, landmarks, parameters, posed, basis, stage)
        return self._solved(gram, side, parameters, stage)

    def _surface_slopes(
        self, matched: Correspondences, parameters: ModelParameters, basis: Float64Array
    ) -> Float64Array:
        """(match, unknown) m: how the surface under each match rises along its normal."""
        corners = self.template.triangles[matched.triangle]
        return self._slopes(corners, matched.bary, matched.normals, parameters, basis)

    def _slopes(
        self,
        corners: NDArray[np.integer],
        bary: Float64Array,
        along: Float64Array,
        parameters: ModelParameters,
        basis: Float64Array,
    ) -> Float64Array:
        """(point, unknown): shapes, joints, translation; along (point, 3) unit directions."""
        from scipy.sparse import csr_matrix

        head = self.template.head
        weights = np.einsum("pc,pcj->pj", bary, head.skin_weights.astype(np.float64)[corners])
        rig = Rig(self.joints(parameters), head.joint_parents, weights)
        matrices, _ = vertex_transforms(rig, parameters.pose.turns)
        back = np.einsum("pab,pa->pb", matrices, along)
        rows = bary[:, :, None] * back[:, None, :]
        columns = 3 * corners[:, :, None].astype(np.int64) + np.arange(3)
        starts = np.arange(len(corners) + 1) * (3 * corners.shape[1])
        spread: Any = csr_matrix(
            (rows.ravel(), columns.ravel(), starts), (len(corners), len(basis))
        )
        shaping = spread @ basis
        identities = len(parameters.identity)
        shaping[:, :identities] += self._pivot_slopes(along, weights, parameters)
        points = np.einsum("pc,pca->pa", bary, self.zero_pose_vertices(parameters)[corners])
        turning = joint_slopes(rig, parameters.pose.turns, points, posed_joints(head))
        return np.concatenate([shaping, np.einsum("pa,pak->pk", along, turning), along], axis=1)

    def _pivot_slopes(
        self, along: Float64Array, weights: Float64Array, parameters: ModelParameters
    ) -> Float64Array:
        """(point, identity): an identity moves the joints too, about which all else then turns.

        What a joint adds to a vertex is linear in the joints' places.
        """
        head, count = self.template.head, len(parameters.identity)
        moved = head.joint_identity_basis[:count].astype(np.float64)
        turns = np.broadcast_to(parameters.pose.turns, (count, *parameters.pose.turns.shape))
        _, shifts = joint_transforms(turns, moved, head.joint_parents)
        carried = np.einsum("pj,kja->pka", weights, shifts, optimize=True)
        return np.einsum("pka,pa->pk", carried, along)

    @cached_property
    def _stiffness(self) -> Float64Array:
        """(expression,) relative cost: a face fitted with its identity is one at rest."""
        cost = np.ones(len(self.template.head.expression_names))
        for place, name in enumerate(self.template.head.expression_names):
            if self.with_identity and UNSEEN_SHAPES.match(name):
                cost[place] = UNSEEN_COST
            elif self.with_identity and BLINKS.match(name):
                cost[place] = BLINK_COST
        return cost

    def _add_landmarks(
        self,
        gram: Float64Array,
        side: Float64Array,
        landmarks: Landmarks,
        parameters: ModelParameters,
        posed: Float64Array,
        basis: Float64Array,
        stage: FitStage,
    ) -> None:
        vertices, places, shares = self.template.landmark_weights(landmarks)
        if not len(vertices):
            return
        apart, shares = places - posed[vertices], shares / shares.sum()
        shares = shares * robust_weights(np.linalg.norm(apart, axis=1), LANDMARK_NOISE_M)
        off_m = float(np.sqrt(shares @ np.square(apart).sum(axis=1) / shares.sum()))
        belief = min(1.0, stage.trusted_m / max(off_m, 1e-9)) ** 2
        shares = MM * np.sqrt(stage.landmarks * belief * shares)
        left = apart * shares[:, None]
        for axis in range(3):
            along = np.zeros((len(vertices), 3))
            along[:, axis] = shares
            slopes = self._slopes(
                vertices[:, None], np.ones((len(vertices), 1)), along, parameters, basis
            )
            gram += slopes.T @ slopes
            side += slopes.T @ left[:, axis]

    def _solved(
        self, gram: Float64Array, side: Float64Array, parameters: ModelParameters, stage: FitStage
    ) -> ModelParameters:
        """The step that solves the normal equations, with ridge and bounds."""
        head = self.template.head
        identities, expressions = len(parameters.identity), len(parameters.expression)
        joints = posed_joints(head)
        count = identities + expressions
        bends = to_axis_angle(parameters.pose.turns[joints[1:]]).ravel()
        cost = np.r_[
            np.full(identities, stage.identity),
            stage.expression * self._stiffness,
            np.zeros(3),
            np.full(len(bends), NECK_COST),
            np.zeros(3),
        ]
        known = np.r_[parameters.identity, parameters.expression, np.zeros(3), bends, np.zeros(3)]
        gram = gram + np.diag(cost + 1e-9 * np.diag(gram) + 1e-12)
        side = side - cost * known
        low, high = np.full(len(side), -np.inf), np.full(len(side), np.inf)
        low[:identities] = -IDENTITY_BOUND - parameters.identity
        high[:identities] = IDENTITY_BOUND - parameters.identity
        if "jawOpen" in head.expression_names:
            span = slice(identities, count)
            low[span], high[span] = (bound - parameters.expression for bound in BOUNDS)
        step = solve_box(gram, side, np.minimum(low, 0), np.maximum(high, 0))
        turns = parameters.pose.turns.copy()
        small = from_axis_angle(step[count:-3].reshape(-1, 3))
        turns[joints] = multiply(small, turns[joints])
        turns /= np.linalg.norm(turns, axis=1, keepdims=True)
        return replace(
            parameters,
            identity=parameters.identity + step[:identities],
            expression=parameters.expression + step[identities:count],
            pose=HeadPose(parameters.pose.translation + step[-3:], turns),
        )
