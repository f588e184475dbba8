"""Inverse linear blend skinning: unposed vertices, and their derivatives by joint rotations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.head.model import HeadModel
from elocute.head.skinning import joint_transforms
from elocute.numerics.rotation_vectors import cross_matrices

ALL = slice(None)


@dataclass(frozen=True, eq=False)
class Rig:
    """The joints of a head, and skin weights of some of its vertices.

    Parameters
    ----------
    joint_positions : (joint, 3) float64
        Metres.
    joint_parents : tuple of int
        The index of each joint's parent, which comes before it; -1 for none.
    skin_weights : (vertex, joint) float64
        Rows sum to one.
    """

    joint_positions: Float64Array
    joint_parents: tuple[int, ...]
    skin_weights: Float64Array


def rig_of(head: HeadModel, vertices: NDArray[np.integer] | slice = ALL) -> Rig:
    """The rig of a head, or of some of its vertices."""
    weights = head.skin_weights[vertices].astype(np.float64)
    return Rig(head.joint_positions.astype(np.float64), head.joint_parents, weights)


def vertex_transforms(rig: Rig, turns: Float64Array) -> tuple[Float64Array, Float64Array]:
    """How vertices are carried by joints that turn by (joint, 4): posed = matrix · vertex + shift.

    Turns are unit quaternions wxyz; blended rotations (vertex, 3, 3) come back, and shifts
    (vertex, 3) in m.
    """
    rotations, translations = joint_transforms(turns, rig.joint_positions, rig.joint_parents)
    joints = len(rig.joint_parents)
    matrices = (rig.skin_weights @ rotations.reshape(joints, 9)).reshape(-1, 3, 3)
    return matrices, rig.skin_weights @ translations


def inverses(matrices: Float64Array) -> Float64Array:
    """Invert small regular matrices by cofactors, many times faster than LAPACK.

    Returns
    -------
    (..., 3, 3) float64
    """
    a, b, c = matrices[..., 0, :], matrices[..., 1, :], matrices[..., 2, :]
    cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-1)
    return cofactors / (a * cofactors[..., 0]).sum(axis=-1)[..., None, None]


def joint_slopes(
    rig: Rig, turns: Float64Array, points: Float64Array, joints: list[int]
) -> Float64Array:
    """How posed vertices move as `joints` turn, from points (vertex, 3), m, before posing.

    Turns (joint, 4) are unit quaternions wxyz. The small rotations come after a joint's own, in its
    parent's frame: a displacement ω × (y - pivot) of what hangs on it.

    Returns
    -------
    (vertex, 3, 3 · joint) float64
        Metres per radian, three columns for each of `joints`.
    """
    rotations, translations = joint_transforms(turns, rig.joint_positions, rig.joint_parents)
    carried = np.einsum("jab,vb->jva", rotations, points) + translations[:, None]
    carried *= rig.skin_weights.T[:, :, None]
    slopes = np.empty((len(points), 3, 3 * len(joints)))
    for place, joint in enumerate(joints):
        below = _descendants(rig.joint_parents, joint)
        pivot = rotations[joint] @ rig.joint_positions[joint] + translations[joint]
        share = rig.skin_weights[:, below].sum(axis=1)
        arms = carried[below].sum(axis=0) - share[:, None] * pivot
        parent = rig.joint_parents[joint]
        frame = np.eye(3) if parent < 0 else rotations[parent]
        slopes[:, :, 3 * place : 3 * place + 3] = cross_matrices(-arms) @ frame
    return slopes


def _descendants(parents: tuple[int, ...], joint: int) -> list[int]:
    """The joint and its descendants; parents come before their children."""
    descendants = [joint]
    for child in range(joint + 1, len(parents)):
        if parents[child] in descendants:
            descendants.append(child)
    return descendants
