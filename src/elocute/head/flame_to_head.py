"""Makes a HeadModel of a FLAME model, so that every writer and renderer takes it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from elocute.head.flame import JOINT_NAMES, FlameModel
from elocute.head.mesh import SKIN_SRGB, head_from_arrays
from elocute.head.model import HeadModel

NOTICE = "Made with FLAME (Li et al. 2017, flame.is.tue.mpg.de), under the licence it came with."
WHITE, IRIS, PUPIL = (228, 222, 216), (92, 66, 46), (20, 16, 14)
IRIS_DEG, PUPIL_DEG = 28.0, 11.0  # half-angles seen from the eye's centre
MATERIALS = ("skin", "eyeball")


def head_from_flame(model: FlameModel, *, name: str = "FLAME") -> HeadModel:
    """A FLAME model as a head: the mean face in zero pose, for every writer and renderer.

    It has all identities and the expressions `flameExpression000`, …, whose weights are standard
    deviations of either sign. FLAME names no places, so landmarks, lips and regions are empty and
    mouth measures refuse this head. Its vertices are those of `flame_vertices`, with pose
    blendshapes and joints that follow the face; a .glb has room for neither.
    """
    identity = np.moveaxis(model.identity_basis, 2, 0)
    expression = np.moveaxis(model.expression_basis, 2, 0)
    triangles, eyes = model.triangles, _eye_vertices(model)
    bare = head_from_arrays(
        name,
        model.template,
        triangles,
        expression_names=tuple(f"flameExpression{index:03d}" for index in range(len(expression))),
        expression_basis=expression,
        notice=NOTICE,
    )
    return replace(
        bare,
        identity_basis=np.ascontiguousarray(identity, np.float32),
        joint_names=model.joint_names,
        joint_parents=model.parents,
        joint_positions=(model.joint_regressor @ model.template).astype(np.float32),
        joint_identity_basis=(model.joint_regressor @ identity).astype(np.float32),
        skin_weights=model.skin_weights.astype(np.float32),
        pose_basis=np.ascontiguousarray(np.moveaxis(model.pose_basis, 2, 0), np.float32),
        joint_regressor=model.joint_regressor.astype(np.float32),
        material=np.where(eyes[triangles].all(axis=1), 1, 0).astype(np.uint8),
        material_names=MATERIALS,
        vertex_color=_colors(model, eyes),
    )


def _eye_vertices(model: FlameModel) -> NDArray[np.bool_]:
    """(vertex,) whether it turns with an eye and nothing else: an eyeball."""
    if model.joint_names != JOINT_NAMES:
        return np.zeros(model.vertex_count, bool)
    return model.skin_weights[:, 3:].max(axis=1) > 0.99


def _colors(model: FlameModel, eyes: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """(vertex, 3) sRGB: skin, and eyes that look ahead."""
    colors = np.tile(np.array(SKIN_SRGB, np.uint8), (model.vertex_count, 1))
    if not eyes.any():
        return colors
    colors[eyes] = WHITE
    side = model.skin_weights[:, 3:].argmax(axis=1)
    for chosen in (eyes & (side == eye) for eye in range(2)):
        ball = model.template[chosen]
        if not len(ball):
            continue
        around = ball - (ball.min(axis=0) + ball.max(axis=0)) / 2
        ahead = around[:, 2] / np.maximum(np.linalg.norm(around, axis=1), 1e-9)
        for half_angle_deg, color in ((IRIS_DEG, IRIS), (PUPIL_DEG, PUPIL)):
            colors[np.flatnonzero(chosen)[ahead > np.cos(np.radians(half_angle_deg))]] = color
    return colors
