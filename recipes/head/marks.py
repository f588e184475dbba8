"""Named places: 68 landmarks and regions."""

from __future__ import annotations

import numpy as np

from recipes.head.face import NeutralFace

LANDMARKS = (
    # jaw
    2230,
    1898,
    866,
    912,
    893,
    1408,
    1759,
    1757,
    1761,
    3912,
    3914,
    3576,
    3075,
    3094,
    3051,
    4046,
    4376,
    # brows
    1726,
    1725,
    229,
    223,
    233,
    2486,
    2477,
    2482,
    3882,
    3883,
    # bridge
    136,
    135,
    164,
    1519,
    # base of the nose
    358,
    314,
    317,
    2557,
    2599,
    # eyes
    1114,
    1057,
    1125,
    1129,
    1096,
    1093,
    3301,
    3297,
    3229,
    3286,
    3265,
    3268,
)
"""Skin vertices of the first 48 iBUG landmarks, by their places on the mean face as it is: look
again when it is sculpted further. Under the nose they once stayed behind on the lip, 9 mm off."""


def landmarks(face: NeutralFace) -> np.ndarray:
    """(68,) vertices in iBUG order; the first are on the head's right side (-X)."""
    rings = face.lips.rings
    outer = [int(rings[0, c]) for c in (26, 32, 35, 0, 3, 6, 12, 16, 17, 19, 21, 22)]
    inner = [int(rings[7, c]) for c in (26, 34, 0, 4, 12, 17, 19, 21)]
    return np.array([*LANDMARKS, *outer, *inner], np.int32)


def regions(face: NeutralFace) -> dict[str, np.ndarray]:
    """Named vertex sets."""
    skin, eye, slices = face.skin, face.assembly.eye_centre, face.assembly.slices
    inner = face.anatomy.inner_mouth
    outside = np.setdiff1d(np.arange(len(skin)), inner)
    ahead = skin[outside]
    is_face = (
        (ahead[:, 2] > eye[2] - 0.055)
        & (ahead[:, 1] > eye[1] - 0.115)
        & (ahead[:, 1] < eye[1] + 0.07)
    )
    around_eye = np.linalg.norm((skin[outside] * [1, 1, 1] - eye) * [1, 1, 0.6], axis=1) < 0.024
    around_other = np.linalg.norm((skin[outside] - eye * [-1, 1, 1]) * [1, 1, 0.6], axis=1) < 0.024
    named = {
        "skin": np.r_[np.arange(len(skin)), slices["scalp"]],
        "face": outside[is_face],
        "lips": np.unique(face.lips.rings[:8]),
        "inner_mouth": inner,
        "eye_area_left": outside[around_eye],
        "eye_area_right": outside[around_other],
        "eyes": np.r_[slices["eye_left"], slices["eye_right"]],
        "teeth": np.r_[slices["teeth_upper"], slices["teeth_lower"]],
        "gums": np.r_[slices["gums_upper"], slices["gums_lower"]],
        "neck_rim": face.anatomy.rim,
    }
    for name, is_upper in (("lid_upper", True), ("lid_lower", False)):
        arc = face.anatomy.lid_arc(skin, is_upper)
        named |= {f"{name}_left": arc, f"{name}_right": face.anatomy.skin_mirror[arc]}
    named |= {name: np.r_[where] for name, where in slices.items() if name not in named}
    return {name: np.asarray(vertices, np.int32) for name, vertices in named.items()}
