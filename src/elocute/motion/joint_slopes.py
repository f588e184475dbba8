"""Linear blend skinning backwards: vertices out of their pose, and how joints would move them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.head.model import HeadModel
from elocute.head.skinning import joint_transforms

Floats = NDArray[np.float64]


def vertex_transforms(head: HeadModel, turns: Floats) -> tuple[Floats, Floats]:
    """(vertex, 3, 3) and (vertex, 3) m: posed = matrix · vertex + shift.

    turns (joint, 4) unit quaternions wxyz.
    """
    rotations, translations = joint_transforms(turns, head.joint_positions, head.joint_parents)
    joints = len(head.joint_names)
    matrices = (head.skin_weights @ rotations.reshape(joints, 9)).reshape(-1, 3, 3)
    return matrices, head.skin_weights @ translations


def inverses(matrices: Floats) -> Floats:
    """(..., 3, 3); by cofactors, many times faster than LAPACK on tiny matrices."""
    a, b, c = matrices[..., 0, :], matrices[..., 1, :], matrices[..., 2, :]
    cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-1)
    return cofactors / (a * cofactors[..., 0]).sum(axis=-1)[..., None, None]


def joint_slopes(head: HeadModel, turns: Floats, points: Floats, joints: list[int]) -> Floats:
    """(vertex, 3, 3 · joint): how posed vertices move as joints turn, m per radian.

    turns (joint, 4), points (vertex, 3) m before posing; the small rotations come after the
    joint's own, in its parent's frame: a displacement ω × (y - pivot) of what hangs on it.
    """
    rotations, translations = joint_transforms(turns, head.joint_positions, head.joint_parents)
    carried = np.einsum("jab,vb->jva", rotations, points) + translations[:, None]
    carried *= head.skin_weights.T[:, :, None]
    slopes = np.empty((len(points), 3, 3 * len(joints)))
    for place, joint in enumerate(joints):
        below = _descendants(head.joint_parents, joint)
        pivot = rotations[joint] @ head.joint_positions[joint] + translations[joint]
        share = head.skin_weights[:, below].sum(axis=1)
        arms = carried[below].sum(axis=0) - share[:, None] * pivot
        parent = head.joint_parents[joint]
        frame = np.eye(3) if parent < 0 else rotations[parent]
        for axis in range(3):
            slopes[:, :, 3 * place + axis] = np.cross(frame[:, axis], arms)
    return slopes


def _descendants(parents: tuple[int, ...], joint: int) -> list[int]:
    """The joint and all that hang on it; parents come before their children."""
    found = [joint]
    for child in range(joint + 1, len(parents)):
        if parents[child] in found:
            found.append(child)
    return found
