"""Solves for FLAME's parameters from vertices on its mesh, by FLAME's own equations.

For a fixed pose FLAME's vertices are affine in shape and expression, pose correctives and moving
joints included, so those slopes are exact; those of the pose are differences. Shape is what all
frames have in common: it is solved together with a few of them, then each frame by itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elocute.array_types import Float64Array
from elocute.errors import HeadError
from elocute.files.array_file import ArrayFile
from elocute.head.flame import JOINT_NAMES, FlameModel, flame_vertices
from elocute.head.flame_parameters import FlameParameters
from elocute.head.flame_slopes import FrameState, PosedPart, scale_of
from elocute.numerics.quaternions import from_matrices, to_axis_angle
from elocute.numerics.rigid_alignment import rigid_alignment

Vertices = ArrayLike | ArrayFile
Unknowns = TypeVar("Unknowns")
Attempt = Callable[[float], tuple[Unknowns, float]]
"""Takes the damping of a step; returns the unknowns that it leads to, and their cost."""
_Shaped = tuple[Float64Array, list[FrameState]]
"""Shape, and the frames that are solved with it."""

REGULARISATION = 1e-6
SHAPE_FRAMES = 5
"""How many frames the shape is solved with where no neutral face is given."""
DRAFT = 1500
"""How many vertices most steps are made on."""
STEPS, LAST_STEPS = 40, 1
TURN_COST = 1e-6
"""Cost of a squared radian of neck and eyes, mm² of mean squared distance."""
TILT = 1e-6  # radians by which slopes of the pose are told
CONVERGED = 1e-7
FLOOR_MM2 = 1e-13


def solve_flame(
    model: FlameModel,
    vertices: Vertices,
    *,
    fps: float = 60.0,
    neutral: ArrayLike | None = None,
    zero_pose: bool = False,
    regularisation: float = REGULARISATION,
    progress: Callable[[float], None] | None = None,
) -> tuple[FlameParameters, NDArray[np.float64]]:
    """Find the FLAME parameters whose vertices come nearest to given ones.

    Parameters
    ----------
    model : FlameModel
        The model.
    vertices : (frame, vertex, 3) or (frame, coordinate)
        Metres, on FLAME's mesh, anywhere in space; flat rows as predictions are often stored.
    fps : float
        Frames per second.
    neutral : (vertex, 3), optional
        The person's resting face, m: shape is then solved from it alone, without expression.
    zero_pose : bool
        Whether neither the head nor the eyes turn and nothing moves in space, as in VOCASET: of the
        pose the jaw alone is solved.
    regularisation : float
        Cost of a squared coefficient in mm² of mean squared distance. What FLAME cannot show counts
        like noise: σ mm of it in each vertex asks for σ² / vertices.
    progress : callable, optional
        Called with the share of the frames that is done, 0 to 1.

    Returns
    -------
    parameters : FlameParameters
        The fit.
    distances : (frame,) float64
        Mean distance of `flame_vertices` of it from the given vertices, mm.

    Raises
    ------
    HeadError
        For another number of vertices, NaN, a model without FLAME's five joints, and a
        regularisation that is not above zero.

    References
    ----------
    Li et al. 2017, section 4; the equations are those of `flame_vertices`.
    """
    points = _checked(model, vertices)
    if model.joint_names != JOINT_NAMES:
        raise HeadError.about("FLAME", found=f"{len(model.parents)} joints", allowed="FLAME's five")
    if not 0 < regularisation < np.inf:
        raise HeadError.about("regularisation", found=f"{regularisation:g}", allowed="above 0 mm²")
    turning = np.array([2] if zero_pose else range(len(JOINT_NAMES)))
    problem = _Problem(model, turning, not zero_pose, regularisation)
    shape = _solve_shape(problem, points, neutral)
    known = replace(problem, shape=shape)
    states: list[FrameState] = []
    for frame in range(len(points)):
        target = _frame(points, frame)
        starts = [known.start(target), *states[-1:]]
        states.append(known.solved(target, starts))
        if progress:
            progress((frame + 1) / len(points))
    parameters = FlameParameters(
        shape,
        np.array([state.expression for state in states]),
        np.array([state.pose for state in states]),
        np.array([state.translation for state in states]),
        fps,
    )
    return parameters, _distances(model, parameters, points)


@dataclass(frozen=True, eq=False)
class _Problem:
    """What all frames share."""

    model: FlameModel
    turning: NDArray[np.intp]
    moving: bool
    regularisation: float
    shape: Float64Array | None = None

    @property
    def identities(self) -> int:
        return self.model.identity_basis.shape[2]

    def part(self, shape: Float64Array, chosen: NDArray[np.intp] | None = None) -> PosedPart:
        model = self.model
        chosen = np.arange(model.vertex_count) if chosen is None else chosen
        shaped = model.template + model.identity_basis @ shape
        expression = np.moveaxis(model.expression_basis, 2, 0)
        return PosedPart(
            shaped[chosen],
            model.joint_regressor @ shaped,
            np.ascontiguousarray(expression[:, chosen]),
            np.einsum("jv,kva->kja", model.joint_regressor, expression),
            np.ascontiguousarray(model.pose_basis[chosen]),
            model.skin_weights[chosen],
            model.parents,
            chosen,
        )

    @property
    def draft(self) -> NDArray[np.intp]:
        """Vertices for most steps, at random: neighbours in number are neighbours in place."""
        count = self.model.vertex_count
        return np.sort(np.random.default_rng(0).permutation(count)[:DRAFT])

    def start(self, target: Float64Array) -> FrameState:
        """A face at rest, laid over the target where it may be anywhere."""
        pose = np.zeros((len(JOINT_NAMES), 3))
        shift = np.zeros(3)
        if self.moving:
            shape = np.zeros(self.identities) if self.shape is None else self.shape
            rest = self.model.template + self.model.identity_basis @ shape
            rotation, moved = rigid_alignment(rest, target)
            pose[0] = to_axis_angle(from_matrices(rotation))
            pivot = self.model.joint_regressor[0] @ rest
            shift = moved + rotation @ pivot - pivot
        return FrameState(np.zeros(self.model.expression_basis.shape[2]), pose.ravel(), shift)

    def solved(self, target: Float64Array, starts: list[FrameState]) -> FrameState:
        """The best state for a known shape."""
        assert self.shape is not None
        part = self._drafted
        few = target[part.chosen]
        state = min(starts, key=lambda start: self._cost(part, start, few))
        state = self._refined(part, few, state, STEPS)
        return self._refined(self._whole, target, state, LAST_STEPS)

    @cached_property
    def _drafted(self) -> PosedPart:
        assert self.shape is not None
        return self.part(self.shape, self.draft)

    @cached_property
    def _whole(self) -> PosedPart:
        assert self.shape is not None
        return self.part(self.shape)

    def _residual(self, part: PosedPart, state: FrameState, target: Float64Array) -> Float64Array:
        return (target - part.points(state)) * scale_of(part)

    def _cost(self, part: PosedPart, state: FrameState, target: Float64Array) -> float:
        left = self._residual(part, state, target)
        return float((left * left).sum() + self._penalty(state))

    def _penalty(self, state: FrameState) -> float:
        turns = state.pose.reshape(-1, 3)[[1, 3, 4]]
        return float(
            self.regularisation * state.expression @ state.expression
            + TURN_COST * np.square(turns).sum()
        )

    def pose_slopes(self, part: PosedPart, state: FrameState) -> Float64Array:
        """(unknown, vertex, 3) m: turns of the joints, then the translation."""
        shaped = part.shaped(state)
        rest = part.posed(*shaped, state.pose)
        slopes = []
        for joint in self.turning:
            for axis in range(3):
                pose = state.pose.copy()
                pose[3 * joint + axis] += TILT
                slopes.append((part.posed(*shaped, pose) - rest) / TILT)
        if self.moving:
            slopes += [np.broadcast_to(unit, rest.shape) for unit in np.eye(3)]
        return np.array(slopes)

    def slopes(self, part: PosedPart, state: FrameState) -> Float64Array:
        """(unknown, vertex · 3), scaled: expression, turns, translation."""
        own = part.along(state, part.expression, part.expression_centres)
        every = np.concatenate([own, self.pose_slopes(part, state)])
        return every.reshape(len(every), -1) * scale_of(part)

    def ridge(self, state: FrameState) -> tuple[Float64Array, Float64Array]:
        """Costs (unknown,) of what `slopes` lists, and the values (unknown,) they count for."""
        cost = np.zeros(len(JOINT_NAMES))
        cost[[1, 3, 4]] = TURN_COST
        turns = np.repeat(cost[self.turning], 3)
        values = state.pose.reshape(-1, 3)[self.turning].ravel()
        shift = np.zeros(3 if self.moving else 0)
        expression = np.full(len(state.expression), self.regularisation)
        return (
            np.concatenate([expression, turns, shift]),
            np.concatenate([state.expression, values, shift]),
        )

    def stepped(self, state: FrameState, step: Float64Array) -> FrameState:
        count, turned = len(state.expression), 3 * len(self.turning)
        pose = state.pose.reshape(-1, 3).copy()
        pose[self.turning] += step[count : count + turned].reshape(-1, 3)
        shift = step[count + turned :] if self.moving else 0
        return FrameState(state.expression + step[:count], pose.ravel(), state.translation + shift)

    def _refined(
        self, part: PosedPart, target: Float64Array, state: FrameState, steps: int
    ) -> FrameState:
        """Levenberg-Marquardt on all of a frame's unknowns."""

        def prepare(state: FrameState) -> Attempt[FrameState]:
            slopes = self.slopes(part, state)
            costs, values = self.ridge(state)
            normal = slopes @ slopes.T + np.diag(costs)
            side = slopes @ self._residual(part, state, target).ravel() - costs * values

            def attempt(damping: float) -> tuple[FrameState, float]:
                damped = normal + damping * np.diag(np.diag(normal) + 1e-12)
                step = np.asarray(np.linalg.solve(damped, side), np.float64)
                tried = self.stepped(state, step)
                return tried, self._cost(part, tried, target)

            return attempt

        return _descended(state, self._cost(part, state, target), prepare, steps)


def _descended(
    state: Unknowns,
    cost: float,
    prepare: Callable[[Unknowns], Attempt[Unknowns]],
    steps: int,
) -> Unknowns:
    """Levenberg-Marquardt: each step is damped as far as it must be for the cost to fall."""
    damping = 1e-9
    for _ in range(steps):
        attempt = prepare(state)
        while True:
            tried, tried_cost = attempt(damping)
            # Where the whole step changes next to nothing, a shorter one does not either.
            if tried_cost < cost or tried_cost - cost < CONVERGED * cost or damping > 1e4:
                break
            damping *= 10
        gained = cost - tried_cost
        if gained <= 0:
            break
        state, cost, damping = tried, tried_cost, max(damping / 10, 1e-12)
        if gained < CONVERGED * cost or cost < FLOOR_MM2:
            break
    return state


def _solve_shape(
    problem: _Problem, frames: NDArray[np.floating] | ArrayFile, neutral: ArrayLike | None
) -> Float64Array:
    """(identity,): Gauss-Newton on shape and a few frames together, the frames eliminated."""
    if not problem.identities:
        return np.zeros(0)
    if neutral is None:
        places = np.unique(np.linspace(0, len(frames) - 1, SHAPE_FRAMES).astype(int))
        targets = [_frame(frames, int(place)) for place in places]
    else:
        rest = np.asarray(neutral, np.float64)
        if rest.shape != problem.model.template.shape or not np.isfinite(rest).all():
            raise HeadError.about(
                "neutral", found=f"{rest.shape}", allowed=f"{problem.model.template.shape}, finite"
            )
        targets = [rest]
        still = problem.model.expression_basis[:, :, :0]
        problem = replace(problem, model=replace(problem.model, expression_basis=still))
    shape = np.zeros(problem.identities)
    states = [problem.start(target) for target in targets]
    identity = np.moveaxis(problem.model.identity_basis, 2, 0)
    centres = np.einsum("jv,kva->kja", problem.model.joint_regressor, identity)
    draft = problem.draft
    few = [target[draft] for target in targets]
    slopes = (np.ascontiguousarray(identity[:, draft]), centres)

    def prepare(known: _Shaped) -> Attempt[_Shaped]:
        part = problem.part(known[0], draft)

        def attempt(damping: float) -> tuple[_Shaped, float]:
            tried = _shape_step(problem, part, *known, few, slopes, damping)
            return tried, _shape_cost(problem, *tried, few)

        return attempt

    shape, _ = _descended((shape, states), _shape_cost(problem, shape, states, few), prepare, STEPS)
    return shape


def _shape_cost(
    problem: _Problem, shape: Float64Array, states: list[FrameState], targets: list[Float64Array]
) -> float:
    part = problem.part(shape, problem.draft)
    costs = [
        problem._cost(part, state, target) for state, target in zip(states, targets, strict=True)
    ]
    return float(sum(costs) + problem.regularisation * shape @ shape)


def _shape_step(
    problem: _Problem,
    part: PosedPart,
    shape: Float64Array,
    states: list[FrameState],
    targets: list[Float64Array],
    identity: tuple[Float64Array, Float64Array],
    damping: float,
) -> tuple[Float64Array, list[FrameState]]:
    """One damped step on shape and frames, each frame's unknowns eliminated (Schur)."""
    count, scale = len(shape), scale_of(part)
    normal = np.zeros((count, count))
    side = -problem.regularisation * shape
    squares = np.full(count, problem.regularisation)
    backwards = []
    for state, target in zip(states, targets, strict=True):
        of_shape = part.along(state, *identity).reshape(count, -1) * scale
        own = problem.slopes(part, state)
        costs, values = problem.ridge(state)
        left = problem._residual(part, state, target).ravel()
        inner = own @ own.T + np.diag(costs)
        inner += damping * np.diag(np.diag(inner) + 1e-12)
        cross, pull = of_shape @ own.T, own @ left - costs * values
        eliminated = np.linalg.solve(inner, np.column_stack([cross.T, pull]))
        squared = of_shape @ of_shape.T
        squares += np.diag(squared)
        normal += squared - cross @ eliminated[:, :-1]
        side += of_shape @ left - cross @ eliminated[:, -1]
        backwards.append(eliminated)
    damped = normal + np.diag(damping * squares + problem.regularisation)
    step = np.linalg.solve(damped, side)
    changed = [
        problem.stepped(state, back[:, -1] - back[:, :-1] @ step)
        for state, back in zip(states, backwards, strict=True)
    ]
    return shape + step, changed


def _frame(frames: NDArray[np.floating] | ArrayFile, frame: int) -> Float64Array:
    target = np.asarray(frames[frame], np.float64).reshape(-1, 3)
    if not np.isfinite(target).all():
        raise HeadError.about("vertices", found=f"NaN or infinity at frame {frame}")
    return target


def _checked(model: FlameModel, vertices: Vertices) -> NDArray[np.floating] | ArrayFile:
    """Vertices of FLAME's mesh; also (frame, 3 · vertex), as predictions are often stored."""
    points = vertices if isinstance(vertices, ArrayFile) else np.asanyarray(vertices)
    count = model.vertex_count
    fits = points.shape[1:] in ((count, 3), (3 * count,))
    if not fits or not len(points) or points.dtype.kind != "f":
        raise HeadError.about(
            "vertices",
            found=f"{points.dtype} {points.shape}",
            allowed=f"floats (frames, {count}, 3) or (frames, {3 * count}), in metres",
        )
    return points


def _distances(
    model: FlameModel, parameters: FlameParameters, frames: NDArray[np.floating] | ArrayFile
) -> NDArray[np.float64]:
    """(frame,) mean mm between FLAME's equations and the given vertices."""
    means = []
    for frame in range(len(parameters.pose)):
        points = flame_vertices(
            model,
            parameters.shape,
            parameters.expression[frame],
            parameters.pose[frame],
            parameters.translation[frame],
        )[0]
        means.append(1000 * np.linalg.norm(points - _frame(frames, frame), axis=1).mean())
    return np.array(means)
