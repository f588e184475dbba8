"""FLAME's heads with the built-in head's shapes, its jaw opened by its own joint."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from elocute.adoption.carrying import Adoption, adopt
from elocute.adoption.flame_places import FLAME_LANDMARKS, FLAME_VERTICES
from elocute.array_types import Float64Array
from elocute.errors import HeadError
from elocute.head.builtin import load_builtin_head
from elocute.head.flame import JOINT_NAMES, FlameModel, flame_vertices
from elocute.head.flame_to_head import head_from_flame
from elocute.head.model import HeadModel

JAW = JOINT_NAMES.index("jaw")
JAW_DEG = np.arange(0.0, 41.0)
"""Angles that the jaw joint is tried at."""
MOVED = 0.8
"""Share of the furthest movement from which a vertex tells how far a jaw is open: the chin and the
lower lip. The corners of the mouth move on their own as well."""


def with_flame_landmarks(head: HeadModel) -> HeadModel:
    """A head on FLAME's mesh with its 68 landmarks.

    Parameters
    ----------
    head : HeadModel
        With FLAME's 5023 vertices.

    Returns
    -------
    HeadModel

    Raises
    ------
    HeadError
        For another number of vertices.
    """
    if head.vertex_count != FLAME_VERTICES:
        raise HeadError.about(
            f"head {head.name!r}",
            found=f"{head.vertex_count} vertices",
            allowed=f"FLAME's {FLAME_VERTICES}, on which landmarks are known",
        )
    return replace(head, landmarks=np.array(FLAME_LANDMARKS, np.int32))


def adopt_flame(model: FlameModel) -> Adoption:
    """A FLAME model that speaks: the built-in head's shapes on its mean face.

    Parameters
    ----------
    model : FlameModel
        With FLAME's 5023 vertices.

    Returns
    -------
    Adoption
        Its head keeps FLAME's identities and joints. `jawOpen` is FLAME's jaw joint opened as far
        as the built-in head's, with FLAME's pose correctives, written as a displacement.

    Raises
    ------
    HeadError
        For another mesh.
    """
    target = with_flame_landmarks(head_from_flame(model))
    own = partial(jaw_opened_as, model) if model.joint_names == JOINT_NAMES else None
    return adopt(load_builtin_head(), target, jaw=own)


def jaw_opened_as(model: FlameModel, carried: Float64Array) -> Float64Array:
    """What FLAME's jaw joint does to the mean face when it opens as far as a given displacement.

    Parameters
    ----------
    model : FlameModel
        Whose joint is turned.
    carried : (vertex, 3) float64
        The opening of another head's jaw on this mesh, m.

    Returns
    -------
    (vertex, 3) float64
        Metres.
    """
    poses = np.zeros((len(JAW_DEG), 3 * len(JOINT_NAMES)))
    poses[:, 3 * JAW] = np.radians(JAW_DEG)
    opened = flame_vertices(model, pose=poses) - model.template
    length = np.linalg.norm(carried, axis=1)
    moved = length > MOVED * length.max()
    # Where the drop of what moves is on average the same.
    drops = -opened[:, moved, 1].mean(axis=1)
    wanted = -carried[moved, 1].mean()
    angle = np.interp(wanted, np.maximum.accumulate(drops), JAW_DEG)
    pose = np.zeros(3 * len(JOINT_NAMES))
    pose[3 * JAW] = np.radians(angle)
    return flame_vertices(model, pose=pose)[0] - model.template
