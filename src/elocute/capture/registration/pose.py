"""The pose of a head: applying it, removing it, and aligning a head with measured points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.head.model import HeadModel
from elocute.motion.joint_jacobians import inverses, rig_of, vertex_transforms
from elocute.numerics.quaternions import from_matrices, no_turn

Float64Array = NDArray[np.float64]

NECK = ("neck", "head")
"""Joints that capture turns; the first of a head's joints always counts as its root."""


@dataclass(frozen=True, eq=False)
class HeadPose:
    """Everything that zero pose is free of.

    Attributes
    ----------
    translation
        (3,) m, after all rotation.
    turns
        (joint, 4) unit quaternions wxyz about the joints of the head.
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

    Kabsch (1976), weighted; the whole head turns by its root joint.
    """
    shares = np.ones(len(model)) if weights is None else weights
    shares = shares / shares.sum()
    middle, target = shares @ model, shares @ measured
    left, _, right = np.linalg.svd((measured - target).T @ (shares[:, None] * (model - middle)))
    sign = np.sign(np.linalg.det(left @ right))
    rotation = left @ np.diag([1.0, 1.0, sign]) @ right
    pose = zero_pose(head)
    pose.turns[0] = from_matrices(rotation)
    pivot = head.joint_positions[0].astype(np.float64)
    # The joint turns about its own place: x → R (x - pivot) + pivot + translation.
    translation = target - rotation @ (middle - pivot) - pivot
    return HeadPose(translation, pose.turns)
