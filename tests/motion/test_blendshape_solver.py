"""Solving: known motions come back from their vertices."""

from dataclasses import replace

import numpy as np
import pytest

from elocute.errors import MotionError
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from elocute.motion.blendshape_solver import solve_weights
from elocute.motion.edits import cut, with_pose
from elocute.motion.joint_jacobians import inverses, joint_slopes, rig_of, vertex_transforms
from elocute.motion.motion import Motion
from elocute.numerics.quaternions import from_axis_angle, multiply, to_axis_angle

JOINTS = ("neck", "head", "jaw", "eyeLeft", "eyeRight")
TURNS = ((5, 20, 3), (-10, 12, 5), (7, 2, 0), (5, -10, 0), (3, 8, 0))


@pytest.fixture(scope="module")
def head():
    return load_builtin_head().with_identity(resolve_identity("ada"))


@pytest.fixture(scope="module")
def talk(head):
    """Four frames of every shape at once, in zero pose."""
    weights = np.random.default_rng(1).normal(0, 0.3, (2, len(head.expression_names)))
    ends = np.clip(weights, 0, 1)
    share = np.linspace(0, 1, 4)[:, None]
    return Motion(head, ends[0] * (1 - share) + ends[1] * share, 30)


@pytest.fixture(scope="module")
def posed(talk):
    for joint, angles in zip(JOINTS, TURNS, strict=True):
        talk = with_pose(talk, joint, [(0, np.array(angles) / 2), (0.1, angles)])
    return talk


def error_degrees(found, wanted):
    inverse = wanted.rotations * np.array([1, -1, -1, -1], np.float32)
    return np.degrees(np.linalg.norm(to_axis_angle(multiply(found.rotations, inverse)), axis=-1))


def test_weights_come_back_from_zero_pose(head, talk):
    found, residual_mm = solve_weights(head, talk.vertices(), fps=30)
    assert residual_mm.shape == (4,) and residual_mm.max() < 0.001
    assert np.abs(found.weights - talk.weights).max() < 0.001
    assert found.fps == 30 and found.rotations is None


@pytest.mark.parametrize("bounds", [None, (0.0, 1.0)])
def test_weights_and_rotations_come_back_together(head, posed, bounds):
    found, residual_mm = solve_weights(head, posed.vertices(), bounds=bounds)
    assert residual_mm.max() < 0.001
    assert np.abs(found.weights - posed.weights).max() < 0.002
    assert error_degrees(found, posed).max() < 0.1


def test_a_head_turned_far(head, talk):
    turned = with_pose(talk, "neck", (20, 110, -30))
    found, residual_mm = solve_weights(head, turned.vertices()[:1])
    assert residual_mm.max() < 0.001
    assert error_degrees(found, cut(turned, 0, 0.03)).max() < 0.1


def test_noise_is_averaged_out(head, posed):
    posed = cut(posed, 0, 0.03)
    noise = np.random.default_rng(2).normal(0, 0.0002, (1, head.vertex_count, 3))
    found, residual_mm = solve_weights(head, posed.vertices() + noise)
    assert residual_mm == pytest.approx(0.2 * np.sqrt(8 / np.pi), rel=0.02)
    assert error_degrees(found, posed)[:, :2].max() < 0.1
    clean = np.linalg.norm(found.vertices() - posed.vertices(), axis=2).mean() * 1000
    assert clean < 0.05


def test_bounds_hold(head, talk):
    beyond = Motion(head, talk.weights * 2 - 0.3, 30)
    found, residual_mm = solve_weights(head, beyond.vertices(), bounds=(0, 1), joints=())
    assert found.weights.min() >= 0 and found.weights.max() <= 1
    # No direction that the bounds leave free makes it any better.
    for change in np.random.default_rng(3).normal(0, 0.02, (20, *found.weights.shape)):
        other = Motion(head, np.clip(found.weights + change, 0, 1), 30)
        before, after = (
            (np.square(m.vertices() - beyond.vertices()).sum(axis=(1, 2))) for m in (found, other)
        )
        assert (after > before * 0.999).all()
    assert residual_mm.min() > 0.1


def test_another_head(head):
    """Any basis, any joints: what a FLAME head or a learned decoder brings."""
    rng = np.random.default_rng(5)
    kept = np.arange(0, 20)
    other = replace(
        head,
        name="other",
        expression_names=tuple(f"component{i:03d}" for i in kept),
        expression_basis=np.tensordot(rng.normal(0, 1, (20, 55)), head.expression_basis, 1),
        joint_names=("root", "neck", "jaw", "left_eye", "right_eye"),
    )
    motion = Motion(other, rng.normal(0, 0.3, (2, 20)).astype(np.float32), 30)
    motion = with_pose(with_pose(motion, "root", (0, 30, 0)), "eye_left", (4, 9, 0))
    found, residual_mm = solve_weights(other, motion.vertices())
    assert residual_mm.max() < 0.001
    assert error_degrees(found, motion).max() < 0.1


def test_slopes_are_those_of_skinning(head):
    rng = np.random.default_rng(6)
    turns = from_axis_angle(rng.normal(0, 0.3, (5, 3)))
    rig = rig_of(head)
    slopes = joint_slopes(rig, turns, head.template, [0, 1, 2, 3, 4])

    def skinned(moved):
        matrices, shifts = vertex_transforms(rig, moved)
        return np.einsum("vab,vb->va", matrices, head.template) + shifts

    for joint in range(5):
        for axis in range(3):
            small = np.zeros((5, 3))
            small[joint, axis] = 1e-6
            change = skinned(multiply(from_axis_angle(small), turns)) - skinned(turns)
            assert np.abs(change / 1e-6 - slopes[:, :, 3 * joint + axis]).max() < 1e-6
    matrices, _ = vertex_transforms(rig, turns)
    assert np.allclose(inverses(matrices), np.linalg.inv(matrices))


@pytest.mark.parametrize(
    ("vertices", "options", "says"),
    [
        (np.zeros((2, 7, 3)), {}, "8842"),
        (np.zeros((8842, 3)), {}, "frames"),
        (np.zeros((0, 8842, 3)), {}, "one frame"),
        (np.full((1, 8842, 3), np.nan), {}, "frame 0"),
        (np.zeros((1, 8842, 3), int), {}, "floats"),
        (np.zeros((1, 8842, 3)), {"joints": ["tail"]}, "tail"),
        (np.zeros((1, 8842, 3)), {"bounds": (1, 0)}, "bounds"),
        (np.zeros((1, 8842, 3)), {"regularisation": 0}, "regularisation"),
    ],
)
def test_what_is_refused(head, vertices, options, says):
    with pytest.raises(MotionError, match=says):
        solve_weights(head, vertices, **options)


def test_vertices_in_another_unit_are_refused(head, talk):
    with pytest.raises(
        MotionError, match=r"vertices: one \d+ m from where it rests, at frame 0; .*m"
    ):
        solve_weights(head, 1000 * talk.vertices(), fps=30)
