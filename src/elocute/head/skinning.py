"""Linear blend skinning with joints given as unit quaternions (w, x, y, z)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.numerics.quaternions import to_matrices

FloatArray = NDArray[np.floating]


def joint_transforms(
    quaternions: FloatArray, joint_positions: FloatArray, parents: tuple[int, ...]
) -> tuple[FloatArray, FloatArray]:
    """World rotation (..., joint, 3, 3) and translation (..., joint, 3) from rest.

    Quaternions (..., joint, 4), positions (joint, 3) or (..., joint, 3).
    """
    return chained(to_matrices(quaternions), joint_positions, parents)


def chained(
    local: FloatArray, joint_positions: FloatArray, parents: tuple[int, ...]
) -> tuple[FloatArray, FloatArray]:
    """World rotation (..., joint, 3, 3) and translation (..., joint, 3) from rest.

    A joint turns by its `local` rotation (..., joint, 3, 3) about its rest position inside its
    parent: G_j = G_parent · T(p) R_j T(-p). Parents come before their children.
    """
    rotations = np.empty_like(local)
    translations = np.empty(local.shape[:-1], local.dtype)
    for joint, parent in enumerate(parents):
        turn, pivot = local[..., joint, :, :], joint_positions[..., joint, :]
        shift = pivot - np.einsum("...ij,...j->...i", turn, pivot)
        if parent < 0:
            rotations[..., joint, :, :] = turn
            translations[..., joint, :] = shift
            continue
        above = rotations[..., parent, :, :]
        rotations[..., joint, :, :] = above @ turn
        carried = np.einsum("...ij,...j->...i", above, shift)
        translations[..., joint, :] = carried + translations[..., parent, :]
    return rotations, translations


def skin(
    vertices: FloatArray,
    quaternions: FloatArray,
    joint_positions: FloatArray,
    parents: tuple[int, ...],
    weights: FloatArray,
) -> FloatArray:
    """(..., vertex, 3) m: v' = Σ_j w_j (R_j v + t_j).

    vertices (..., vertex, 3), quaternions (..., joint, 4), weights (vertex, joint).
    """
    return blended(vertices, *joint_transforms(quaternions, joint_positions, parents), weights)


def blended(
    vertices: FloatArray, rotations: FloatArray, translations: FloatArray, weights: FloatArray
) -> FloatArray:
    """(..., vertex, 3) m: vertices (..., vertex, 3) carried by world transforms of joints."""
    mixed = np.einsum("vj,...jab->...vab", weights, rotations)
    moved = np.einsum("...vab,...vb->...va", mixed, vertices)
    return moved + np.einsum("vj,...ja->...va", weights, translations)
