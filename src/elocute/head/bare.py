"""A HeadModel out of little: a mesh that names no places."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.head.model import HeadModel

SKIN = (206, 162, 142)  # sRGB


def bare_head(
    name: str,
    template: NDArray[np.floating],
    faces: NDArray[np.integer],
    *,
    expression_names: tuple[str, ...] = (),
    expression_basis: NDArray[np.floating] | None = None,
    notice: str = "",
) -> HeadModel:
    """A head with one colour and one joint.

    template (vertex, 3) m, faces (face, 3 or 4), expression_basis (component, vertex, 3) m.
    Landmarks, lips and regions are empty: what measures a mouth refuses this head. Raises
    HeadError for faces that point past the vertices and numbers that are not finite.
    """
    vertices, nothing = len(template), np.zeros(0, np.int32)
    if expression_basis is None:
        expression_basis = np.zeros((0, vertices, 3))
    quads = faces if faces.shape[1] == 4 else np.concatenate([faces, faces[:, 2:]], axis=1)
    return HeadModel(
        name=name,
        template=template.astype(np.float32),
        quads=quads.astype(np.int32),
        uv=np.zeros((1, 2), np.float32),
        uv_quads=np.zeros((len(faces), 4), np.int32),
        identity_basis=np.zeros((0, vertices, 3), np.float32),
        expression_names=expression_names,
        expression_basis=np.ascontiguousarray(expression_basis, np.float32),
        joint_names=("head",),
        joint_parents=(-1,),
        joint_positions=template.mean(axis=0, keepdims=True).astype(np.float32),
        joint_identity_basis=np.zeros((0, 1, 3), np.float32),
        skin_weights=np.ones((vertices, 1), np.float32),
        landmarks=nothing,
        lip_rings=np.zeros((0, 0), np.int32),
        outer_lip_upper=nothing,
        outer_lip_lower=nothing,
        inner_lip_upper=nothing,
        inner_lip_lower=nothing,
        outer_corners=nothing,
        inner_corners=nothing,
        regions={},
        material=np.zeros(len(faces), np.uint8),
        material_names=("skin",),
        vertex_color=np.tile(np.array(SKIN, np.uint8), (vertices, 1)),
        occlusion=np.ones(vertices, np.float32),
        mirror=nothing,
        notice=notice,
    )
