"""Where a head stands and how its neck is turned: posing and unposing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.head.model import HeadModel
from elocute.motion.joint_jacobians import Rig, inverses, rig_of, vertex_transforms
from elocute.numerics.quaternions import from_matrices, no_turn
from elocute.numerics.rigid_alignment import rigid_alignment

Floats = NDArray[np.float64]

NECK = ("neck", "head")
"""Joints that capture turns; the first of a head's joints always counts as its root."""


@dataclass(frozen=True, eq=False)
class Pose:
    """Everything that zero pose is free of.

    translation  (3,) m, after all turning
    turns        (joint, 4) unit quaternions wxyz about the joints of the head
    """

    translation: Floats
    turns: Floats


def still(head: HeadModel) -> Pose:
    """The zero pose."""
    return Pose(np.zeros(3), no_turn(len(head.joint_names)).astype(np.float64))


def turning_joints(head: HeadModel) -> list[int]:
    """The root, and the joints between neck and head; jaw and eyes are shapes' business."""
    return [joint for joint, name in enumerate(head.joint_names) if joint == 0 or name in NECK]


def posed(head: HeadModel, vertices: Floats, pose: Pose) -> Floats:
    """(vertex, 3) m: vertices in zero pose, turned and moved."""
    matrices, shifts = vertex_transforms(rig_of(head), pose.turns)
    return np.einsum("vab,vb->va", matrices, vertices) + shifts + pose.translation


def unposed(head: HeadModel, vertices: Floats, pose: Pose) -> Floats:
    """(vertex, 3) m: `posed` backwards, exactly (VOCA 2019, section 6: unposing)."""
    matrices, shifts = vertex_transforms(rig_of(head), pose.turns)
    return np.einsum("vab,vb->va", inverses(matrices), vertices - shifts - pose.translation)


def laid_over(
    head: HeadModel, model: Floats, measured: Floats, weights: Floats | None = None
) -> Pose:
    """The rigid pose that brings points of the model (point, 3) m nearest to measured ones.

    The whole head turns by its root joint.
    """
    rotation, shift = rigid_alignment(model, measured, weights)
    pose = still(head)
    pose.turns[0] = from_matrices(rotation)
    pivot = head.joint_positions[0].astype(np.float64)
    # The joint turns about its own place: x → R (x - pivot) + pivot + translation.
    return Pose(shift + rotation @ pivot - pivot, pose.turns)


def rig_at(head: HeadModel, triangles: NDArray[np.integer], bary: Floats) -> Rig:
    """The rig of points on triangles: corners (point, 3), bary (point, 3)."""
    weights = np.einsum("pc,pcj->pj", bary, head.skin_weights.astype(np.float64)[triangles])
    return Rig(head.joint_positions.astype(np.float64), head.joint_parents, weights)
