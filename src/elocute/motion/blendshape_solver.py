"""Solves for blendshape weights and joint rotations from vertices."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elocute.array_types import Float64Array
from elocute.errors import MotionError
from elocute.files.array_file import ArrayFile
from elocute.head.joints import joint_index
from elocute.head.model import HeadModel
from elocute.motion.joint_jacobians import (
    ALL,
    Rig,
    inverses,
    joint_slopes,
    rig_of,
    vertex_transforms,
)
from elocute.motion.motion import REACH_MAX_M, Motion
from elocute.numerics.bounded_least_squares import solve_box
from elocute.numerics.quaternions import from_axis_angle, from_matrices, multiply, no_turn
from elocute.numerics.rigid_alignment import nearest_rotation

Vertices = ArrayLike | ArrayFile

REGULARISATION = 1e-6
STEPS = 60
CLOSE_MM = 0.002
"""Shapes alone that come so close leave nothing for the joints to explain."""
CONVERGED = 1e-7
"""Share of the cost below which a step no longer counts."""
FLOOR_MM2 = 1e-9
"""Cost at which float32 vertices have nothing left to tell."""
DRAFT = 2000
"""Vertices on which rotations are sought before all of them are looked at."""
BLOCK = 120


def solve_weights(
    head: HeadModel,
    vertices: Vertices,
    *,
    fps: float = 60.0,
    regularisation: float = REGULARISATION,
    bounds: tuple[float, float] | None = None,
    joints: Sequence[str] | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[Motion, NDArray[np.float64]]:
    """Find the motion of a head whose vertices come nearest to given ones.

    Parameters
    ----------
    head : HeadModel
        The head to fit.
    vertices : (frame, vertex, 3)
        Metres, vertex for vertex those of the head. A Motion turns about its joints and never
        shifts, so vertices that drift have to be aligned with the head first.
    fps : float
        Frames per second of the result.
    regularisation : float
        Cost of a squared weight in mm² of mean squared distance; it decides between shapes that
        look alike and keeps weights small.
    bounds : (float, float), optional
        Lowest and highest weight: (0, 1) for shapes such as ARKit's; None for no bounds.
    joints : sequence of str, optional
        The joints that may turn; None for all, () for vertices in zero pose.
    progress : callable, optional
        Called with the share of the frames that is done, 0 to 1.

    Returns
    -------
    motion : Motion
        The fit.
    distances : (frame,) float64
        Mean distance of its vertices from the given ones, mm.

    Raises
    ------
    MotionError
        For another number of vertices, NaN, unknown joints, bounds without room, and a
        regularisation that is not above zero.

    Notes
    -----
    Shapes alone are solved at once, as the basis is linear. Where they leave a remainder, the root
    joint is aligned by Procrustes (Kabsch 1976), and Levenberg-Marquardt steps on weights and
    rotations together follow, in the frame of the face in zero pose, where the basis stays the
    same. Rotations cost nothing. Each frame starts from the one before.
    """
    given = _checked(head, vertices)
    if not 0 < regularisation < np.inf:
        raise MotionError(f"regularisation: found {regularisation:g}; allowed: above 0 mm²")
    limits = _limits(head, bounds)
    problem = _problem(head, ALL, _turning(head, joints), regularisation, limits)
    draft = _problem(head, _sample(head), problem.joints, regularisation, limits)
    weights = np.empty((len(given), len(head.expression_names)))
    turns = no_turn(len(given), len(head.joint_names)).astype(np.float64)
    state: _State | None = None
    for frame in range(len(given)):
        target = np.asarray(given[frame], np.float64)
        if not np.isfinite(target).all():
            raise MotionError(f"vertices: found NaN or infinity at frame {frame}")
        if (far := np.abs(target - head.template).max()) > REACH_MAX_M:
            found = f"one {far:.3g} m from where it rests, at frame {frame}"
            raise MotionError.about("vertices", found=found, allowed=f"metres, to {REACH_MAX_M:g}")
        state = _solve_frame(problem, draft, target, state)
        weights[frame], turns[frame] = state.weights, state.turns
        if progress:
            progress((frame + 1) / len(given))
    turned = np.abs(turns[..., 1:]).max(initial=0.0) > 0
    motion = Motion(
        head, weights.astype(np.float32), fps, turns.astype(np.float32) if turned else None
    )
    return motion, distance_mm(motion, given)


def distance_mm(motion: Motion, vertices: Vertices) -> NDArray[np.float64]:
    """(frame,) mean distance in mm between a motion's vertices and others (frame, vertex, 3) m."""
    given = vertices if isinstance(vertices, ArrayFile) else np.asanyarray(vertices)
    means = [
        np.linalg.norm(points - given[start : start + len(points)], axis=2).mean(axis=1)
        for start, points in zip(
            range(0, motion.frame_count, BLOCK), motion.blocks(BLOCK), strict=True
        )
    ]
    return 1000 * np.concatenate(means).astype(np.float64)


@dataclass(frozen=True)
class _State:
    """One frame's unknowns: weights (component,), turns (joint, 4), and cost in mm²."""

    weights: Float64Array
    turns: Float64Array
    cost: float
    distance_mm: float


@dataclass(frozen=True, eq=False)
class _Problem:
    """What all frames share, on all of the head's vertices or a sample of them.

    Lengths are in mm over the root of the vertex count (times `scale`), so sums are means.
    """

    vertices: NDArray[np.integer] | slice
    template: Float64Array  # (vertex, 3) m
    basis: Float64Array  # (component, 3 · vertex), scaled
    rig: Rig
    joints: list[int]  # those that may turn
    regularisation: float
    low: Float64Array
    high: Float64Array

    @property
    def scale(self) -> float:
        return 1000 / np.sqrt(len(self.template))

    @cached_property
    def gram(self) -> Float64Array:
        return self.basis @ self.basis.T + self.regularisation * np.eye(len(self.low))

    def points(self, weights: Float64Array) -> Float64Array:
        """(vertex, 3) m before posing."""
        return self.template + (weights @ self.basis).reshape(-1, 3) / self.scale

    def state(self, weights: Float64Array, turns: Float64Array, target: Float64Array) -> _State:
        left, _ = self.residual(weights, turns, target)
        cost = float((left * left).sum() + self.regularisation * weights @ weights)
        return _State(weights, turns, cost, float(np.sqrt((left * left).sum())))

    def residual(
        self, weights: Float64Array, turns: Float64Array, target: Float64Array
    ) -> tuple[Float64Array, Float64Array]:
        """Residual (vertex, 3), scaled, in zero pose, and the unposing matrices."""
        matrices, shifts = vertex_transforms(self.rig, turns)
        unpose = inverses(matrices)
        unposed = np.einsum("vab,vb->va", unpose, target - shifts)
        return self.scale * (unposed - self.points(weights)), unpose

    def best_weights(self, turns: Float64Array, target: Float64Array) -> Float64Array:
        """Weights for given rotations: linear least squares in zero pose."""
        left, _ = self.residual(np.zeros_like(self.low), turns, target)
        return solve_box(self.gram, self.basis @ left.ravel(), self.low, self.high)


def _problem(
    head: HeadModel,
    vertices: NDArray[np.integer] | slice,
    joints: list[int],
    regularisation: float,
    limits: tuple[Float64Array, Float64Array],
) -> _Problem:
    template = head.template[vertices].astype(np.float64)
    basis = head.expression_basis[:, vertices].astype(np.float64).reshape(len(limits[0]), -1)
    basis *= 1000 / np.sqrt(len(template))
    rig = rig_of(head, vertices)
    return _Problem(vertices, template, basis, rig, joints, regularisation, *limits)


def _sample(head: HeadModel) -> NDArray[np.integer]:
    """Enough vertices for a first pose, at random: neighbours in number are neighbours in place."""
    count = min(DRAFT, head.vertex_count)
    return np.sort(np.random.default_rng(0).permutation(head.vertex_count)[:count])


def _solve_frame(
    problem: _Problem, draft: _Problem, target: Float64Array, before: _State | None
) -> _State:
    """One frame; `before` is the solved frame before it."""
    still = _still(problem)
    state = problem.state(problem.best_weights(still, target), still, target)
    if not problem.joints or state.distance_mm < CLOSE_MM:
        return state
    few = target[draft.vertices]
    starts = [draft.state(state.weights, still, few)]
    if before is not None:
        starts.append(draft.state(draft.best_weights(before.turns, few), before.turns, few))
    if before is None or starts[1].cost > starts[0].cost:
        starts.append(_root_aligned(draft, few))
    drafted = _refined(draft, few, min(starts, key=lambda start: start.cost))
    return _refined(problem, target, problem.state(drafted.weights, drafted.turns, target))


def _still(problem: _Problem) -> Float64Array:
    """(joint, 4) quaternions of the zero pose."""
    return no_turn(len(problem.rig.joint_parents)).astype(np.float64)


def _root_aligned(problem: _Problem, target: Float64Array) -> _State:
    """The root joint aligned with the target: Kabsch (1976), without the translation."""
    turns = _still(problem)
    if problem.rig.joint_parents[problem.joints[0]] < 0:
        rest = problem.template - problem.template.mean(axis=0)
        rotation, _ = nearest_rotation((target - target.mean(axis=0)).T @ rest)
        turns[problem.joints[0]] = from_matrices(rotation)
    return problem.state(problem.best_weights(turns, target), turns, target)


def _refined(problem: _Problem, target: Float64Array, state: _State) -> _State:
    """Levenberg-Marquardt on weights and rotations together."""
    damping = 1e-6
    for _ in range(STEPS):
        if state.cost - problem.regularisation * state.weights @ state.weights < FLOOR_MM2:
            break
        normal, side = _normal_equations(problem, target, state)
        while True:
            tried = _stepped(problem, target, state, normal, side, damping)
            if tried.cost < state.cost or damping > 1e6:
                break
            damping *= 10
        gained = state.cost - tried.cost
        if gained <= 0:
            break
        state, damping = tried, max(damping / 10, 1e-12)
        if gained < CONVERGED * state.cost:
            break
    return state


def _normal_equations(
    problem: _Problem, target: Float64Array, state: _State
) -> tuple[Float64Array, Float64Array]:
    left, unpose = problem.residual(state.weights, state.turns, target)
    slopes = joint_slopes(problem.rig, state.turns, problem.points(state.weights), problem.joints)
    slopes = problem.scale * (unpose @ slopes).reshape(left.size, -1)
    cross = problem.basis @ slopes
    normal = np.block([[problem.gram, cross], [cross.T, slopes.T @ slopes]])
    pull = problem.basis @ left.ravel() - problem.regularisation * state.weights
    return normal, np.concatenate([pull, slopes.T @ left.ravel()])


def _stepped(
    problem: _Problem,
    target: Float64Array,
    state: _State,
    normal: Float64Array,
    side: Float64Array,
    damping: float,
) -> _State:
    count = len(state.weights)
    free = np.full(3 * len(problem.joints), np.inf)
    damped = normal + damping * np.diag(np.diag(normal) + 1e-9)
    step = solve_box(
        damped,
        side,
        np.concatenate([problem.low - state.weights, -free]),
        np.concatenate([problem.high - state.weights, free]),
    )
    turns = state.turns.copy()
    small = from_axis_angle(step[count:].reshape(-1, 3))
    turns[problem.joints] = multiply(small, turns[problem.joints])
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    return problem.state(state.weights + step[:count], turns, target)


def _turning(head: HeadModel, joints: Sequence[str] | None) -> list[int]:
    """Places of the joints that may turn, parents first; those that move nothing are left out."""
    names = head.joint_names if joints is None else joints
    wanted = {joint_index(head, name) for name in names}
    carries = head.skin_weights.max(axis=0) > 0
    for joint in reversed(range(len(carries))):
        if head.joint_parents[joint] >= 0:
            carries[head.joint_parents[joint]] |= carries[joint]
    return [joint for joint in sorted(wanted) if carries[joint]]


def _limits(
    head: HeadModel, bounds: tuple[float, float] | None
) -> tuple[Float64Array, Float64Array]:
    low, high = (-np.inf, np.inf) if bounds is None else bounds
    if not low < high or low > 0 or high < 0:
        raise MotionError(f"bounds: found {low:g} to {high:g}; allowed: rising, zero within")
    count = len(head.expression_names)
    return np.full(count, low), np.full(count, high)


def _checked(head: HeadModel, vertices: Vertices) -> NDArray[np.floating] | ArrayFile:
    given = vertices if isinstance(vertices, ArrayFile) else np.asanyarray(vertices)
    if given.ndim != 3 or given.shape[1:] != head.template.shape or not len(given):
        raise MotionError(
            f"vertices: found shape {given.shape}; allowed: (frames, {head.vertex_count}, 3) "
            f"for head {head.name!r}, with at least one frame"
        )
    if given.dtype.kind != "f":
        raise MotionError(f"vertices: found {given.dtype} numbers; allowed: floats, in metres")
    return given
