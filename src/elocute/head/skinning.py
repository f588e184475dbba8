"""Linear blend skinning with joints given as unit quaternions (w, x, y, z)."""

from __future__ import annotations

import numpy as np

from elocute.array_types import FloatArray
from elocute.numerics.quaternions import to_matrices


def joint_transforms(
    quaternions: FloatArray, joint_positions: FloatArray, parents: tuple[int, ...]
) -> tuple[FloatArray, FloatArray]:
    """World transforms of joints that turn by quaternions.

    Parameters
    ----------
    quaternions : (..., joint, 4)
        Unit quaternions wxyz, each relative to the parent.
    joint_positions : (joint, 3) or (..., joint, 3)
        Rest positions, m.
    parents : tuple of int
        The index of each joint's parent, which comes before it; -1 for none.

    Returns
    -------
    rotations : (..., joint, 3, 3)
        From rest.
    translations : (..., joint, 3)
        From rest, m.
    """
    return chained(to_matrices(quaternions), joint_positions, parents)


def chained(
    local: FloatArray, joint_positions: FloatArray, parents: tuple[int, ...]
) -> tuple[FloatArray, FloatArray]:
    """World transforms of joints that turn by matrices.

    A joint turns about its rest position inside its parent: G_j = G_parent · T(p) R_j T(-p).

    Parameters
    ----------
    local : (..., joint, 3, 3)
        Rotations, each relative to the parent.
    joint_positions : (joint, 3) or (..., joint, 3)
        Rest positions, m.
    parents : tuple of int
        The index of each joint's parent, which comes before it; -1 for none.

    Returns
    -------
    rotations : (..., joint, 3, 3)
        From rest.
    translations : (..., joint, 3)
        From rest, m.
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
    """Linear blend skinning: v' = Σ_j w_j (R_j v + t_j).

    Parameters
    ----------
    vertices : (..., vertex, 3)
        At rest, m.
    quaternions : (..., joint, 4)
        Unit quaternions wxyz, each relative to the parent.
    joint_positions : (joint, 3) or (..., joint, 3)
        Rest positions, m.
    parents : tuple of int
        The index of each joint's parent, which comes before it; -1 for none.
    weights : (vertex, joint)
        Skin weights; rows sum to one.

    Returns
    -------
    (..., vertex, 3)
        Metres.
    """
    return blended(vertices, *joint_transforms(quaternions, joint_positions, parents), weights)


def blended(
    vertices: FloatArray, rotations: FloatArray, translations: FloatArray, weights: FloatArray
) -> FloatArray:
    """Carry vertices by world transforms of joints.

    Parameters
    ----------
    vertices : (..., vertex, 3)
        At rest, m.
    rotations : (..., joint, 3, 3)
        From rest.
    translations : (..., joint, 3)
        From rest, m.
    weights : (vertex, joint)
        Skin weights; rows sum to one.

    Returns
    -------
    (..., vertex, 3)
        Metres.
    """
    # Long rows, one for each coordinate, go several times faster than short ones.
    joined = np.concatenate([rotations, translations[..., None]], axis=-1)
    joined = np.moveaxis(joined, -3, -1)
    mixed = joined.reshape(*joined.shape[:-3], 12, -1) @ np.ascontiguousarray(weights.T)
    mixed = mixed.reshape(*mixed.shape[:-2], 3, 4, -1)
    rows = np.ascontiguousarray(np.swapaxes(vertices, -1, -2))[..., None, :, :]
    moved = mixed[..., 3, :]
    for axis in range(3):
        moved = moved + mixed[..., axis, :] * rows[..., axis, :]
    return np.ascontiguousarray(np.swapaxes(moved, -1, -2))
