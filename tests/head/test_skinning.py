"""Linear blend skinning against rotations worked out by hand."""

import numpy as np
import pytest

from elocute.head import load_builtin_head
from elocute.head.skinning import skin
from elocute.numerics.quaternions import to_matrices

IDENTITY = np.array([1.0, 0, 0, 0])


def about_x(degrees):
    half = np.radians(degrees) / 2
    return np.array([np.cos(half), np.sin(half), 0, 0])


def test_a_quarter_turn_about_x_takes_y_to_z():
    turned = to_matrices(about_x(90)) @ [0, 1, 0]
    assert np.allclose(turned, [0, 0, 1])


def test_rest_pose_changes_nothing():
    head = load_builtin_head()
    rest = np.tile(IDENTITY, (len(head.joint_names), 1))
    posed = skin(head.template, rest, head.joint_positions, head.joint_parents, head.skin_weights)
    assert np.allclose(posed, head.template, atol=1e-6)


def test_children_follow_their_parents():
    joints = np.array([[0.0, 0, 0], [0, 1, 0]])
    points = np.array([[0.0, 2, 0]])
    weights = np.array([[0.0, 1.0]])
    posed = skin(points, np.stack([about_x(90), about_x(90)]), joints, (-1, 0), weights)
    # The child first folds the point from (0, 2, 0) to (0, 1, 1), its parent then to (0, -1, 1).
    assert np.allclose(posed, [[0, -1, 1]])


def test_turning_the_jaw_joint_is_the_jaw_open_shape_for_the_teeth():
    head = load_builtin_head()
    pose = np.tile(IDENTITY, (len(head.joint_names), 1))
    pose[head.joint_names.index("jaw")] = about_x(20)
    posed = skin(head.template, pose, head.joint_positions, head.joint_parents, head.skin_weights)
    teeth = head.regions["teeth_lower"]
    by_shape = head.template + head.expression_basis[head.expression_index("jawOpen")]
    assert np.allclose(posed[teeth], by_shape[teeth], atol=1e-5)


def test_frames_are_posed_all_at_once():
    head = load_builtin_head()
    frames = np.tile(IDENTITY, (3, len(head.joint_names), 1))
    frames[2, head.joint_names.index("head")] = about_x(10)
    points = np.broadcast_to(head.template, (3, *head.template.shape))
    arguments = head.joint_positions, head.joint_parents, head.skin_weights
    together = skin(points, frames, *arguments)
    alone = skin(head.template, frames[2], *arguments)
    assert together.shape == (3, *head.template.shape)
    assert np.allclose(together[2], alone, atol=1e-6)


@pytest.mark.parametrize("joint", ["neck", "head"])
def test_head_and_neck_leave_the_bust_alone_or_carry_it(joint):
    head = load_builtin_head()
    pose = np.tile(IDENTITY, (len(head.joint_names), 1))
    pose[head.joint_names.index(joint)] = about_x(15)
    posed = skin(head.template, pose, head.joint_positions, head.joint_parents, head.skin_weights)
    moved = np.linalg.norm(posed - head.template, axis=1)
    assert moved[head.landmarks[30]] > 0.01
    assert (moved[head.regions["neck_rim"]].max() < 1e-5) == (joint == "head")
