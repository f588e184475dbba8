"""The pose of a head: applying it, removing it, and aligning a head with measured points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float64Array
from elocute.head.model import HeadModel
from elocute.motion.joint_jacobians import inverses, rig_of, vertex_transforms
from elocute.numerics.quaternions import from_matrices, no_turn
from elocute.numerics.rigid_alignment import rigid_alignment

NECK = ("neck", "head")
"""Joints that capture turns; the first of a head's joints always counts as its root."""


@dataclass(frozen=True, eq=False)
class HeadPose:
    """Everything that zero pose is free of.

    translation: (3,) m, after all rotation. turns: (joint, 4) unit quaternions wxyz about the
    joints of the head.
    """

    translation: Float64Array
    turns: Float64Array


def zero_pose(head: HeadModel) -> HeadPose:
    """The zero pose."""
    return HeadPose(np.zeros(3), no_turn(len(head.joint_names)).astype(np.float64))


def posed_joints(head: HeadModel) -> list[int]:
    """The root, neck and head; jaw and eyes are left to the shapes."""
    return [joint for joint, name in enumerate(head.joint_names) if joint == 0 or name in NECK]


def apply_pose(head: HeadModel, vertices: Float64Array, pose: HeadPose) -> Float64Array:
    """(vertex, 3) m: vertices in zero pose, rotated and moved."""
    matrices, shifts = vertex_transforms(rig_of(head), pose.turns)
    return np.einsum("vab,vb->va", matrices, vertices) + shifts + pose.translation


def remove_pose(head: HeadModel, vertices: Float64Array, pose: HeadPose) -> Float64Array:
    """(vertex, 3) m: the exact inverse of `apply_pose` (VOCA 2019, section 6: unposing)."""
    matrices, shifts = vertex_transforms(rig_of(head), pose.turns)
    return np.einsum("vab,vb->va", inverses(matrices), vertices - shifts - pose.translation)


def align_head(
    head: HeadModel,
    model: Float64Array,
    measured: Float64Array,
    weights: Float64Array | None = None,
) -> HeadPose:
    """The rigid pose that brings points of the model (point, 3) m nearest to measured ones.

    The whole head turns by its root joint.
    """
    rotation, shift = rigid_alignment(model, measured, weights)
    pose = zero_pose(head)
    pose.turns[0] = from_matrices(rotation)
    pivot = head.joint_positions[0].astype(np.float64)
    # The joint turns about its own place: x → R (x - pivot) + pivot + translation.
    return HeadPose(shift + rotation @ pivot - pivot, pose.turns)
