"""Skin weights of the five joints."""

from __future__ import annotations

import numpy as np

from recipes.head.face import NeutralFace
from recipes.head.identity import JOINT_NAMES

NECK_BONES = {"neck03": 0.6, "neck02": 0.25}
"""How far the upper neck already turns with the head."""

NECK_M = 0.05
"""Height over the bust's cut below which the neck turns less and less with the head."""


def skin_weights(face: NeutralFace) -> np.ndarray:
    """(vertex, joint), rows sum to one."""
    mh, anatomy, slices = face.mh, face.anatomy, face.assembly.slices
    column = {name: i for i, name in enumerate(JOINT_NAMES)}
    with_head = np.zeros(len(mh.base.vertices))
    for bone, weight in mh.bone_weights.items():
        chain = mh.ancestors(bone)
        if "head" in chain:
            with_head += weight
        elif bone in NECK_BONES:
            with_head += NECK_BONES[bone] * weight
    weights = np.zeros((face.assembly.count, len(JOINT_NAMES)))
    weights[:, column["head"]] = 1
    skin = slices["skin"]
    with_head = np.clip(anatomy.skin_stencil @ with_head[anatomy.skin_of_base], 0, 1)
    with_head *= face.off_the_bust(NECK_M)[skin]
    weights[skin, column["head"]] = with_head
    weights[skin, column["neck"]] = 1 - with_head
    jaw = np.minimum(face.jaw_weights, weights[:, column["head"]])
    weights[:, column["jaw"]] = jaw
    weights[:, column["head"]] -= jaw
    for side in ("Left", "Right"):
        eye = slices[f"eye_{side.lower()}"]
        weights[eye] = 0
        weights[eye, column[f"eye{side}"]] = 1
    # Smooth mixtures overshoot a little where weights end.
    weights = np.clip(face.assembly.attach(weights, offset=False), 0, 1)
    weights = (weights + _swapped(weights, face.assembly.mirror)) / 2
    return weights / weights.sum(1, keepdims=True)


def _swapped(weights: np.ndarray, mirror: np.ndarray) -> np.ndarray:
    other = weights[mirror]
    return other[:, [0, 1, 2, 4, 3]]
