"""Named places: 68 landmarks and regions."""

from __future__ import annotations

import numpy as np

from recipes.head.face import NeutralFace


def landmarks(face: NeutralFace) -> np.ndarray:
    """(68,) vertices in iBUG order; the first are on the head's right side (-X)."""
    skin, eye = face.skin, face.assembly.eye_centre
    rings = face.lips.rings
    front = np.zeros(len(skin), bool)
    front[:] = skin[:, 2] > eye[2] - 0.075
    front[face.anatomy.inner_mouth] = False

    def nearest(x_mm: float, y_mm: float, z_mm: float) -> int:
        """Vertex closest to a place relative to the point between the eyes' centres."""
        goal = np.array([x_mm, y_mm, z_mm]) / 1000 + [0, eye[1], eye[2]]
        distance = np.linalg.norm(skin - goal, axis=1) + np.where(front, 0, 1)
        return int(distance.argmin())

    half_jaw = [
        (-66, 0, -58),
        (-65, -22, -58),
        (-63, -42, -56),
        (-58, -62, -48),
        (-49, -78, -32),
        (-38, -90, -14),
        (-26, -99, 2),
        (-13, -105, 12),
    ]
    jaw = [nearest(*p) for p in half_jaw] + [nearest(0, -107, 15)]
    jaw += [nearest(-x, y, z) for x, y, z in reversed(half_jaw)]
    half_brow = [(-50, 18, -1), (-43, 23, 8), (-34, 24, 13), (-24, 22, 17), (-14, 19, 20)]
    brows = [nearest(*p) for p in half_brow] + [
        nearest(-x, y, z) for x, y, z in reversed(half_brow)
    ]
    bridge = [nearest(0, y, z) for y, z in ((2, 22), (-12, 27), (-25, 34), (-38, 41))]
    base = [
        nearest(x, y, z)
        for x, y, z in ((-14, -47, 20), (-7, -50, 25), (0, -52, 28), (7, -50, 25), (14, -47, 20))
    ]
    eyes = []
    half_eye = [(-44, 0, 4), (-36, 5, 12), (-25, 5, 13), (-16, -2, 9), (-25, -6, 12), (-36, -6, 10)]
    eyes += [nearest(*p) for p in half_eye]
    eyes += [nearest(-half_eye[i][0], *half_eye[i][1:]) for i in (3, 2, 1, 0, 5, 4)]
    outer = [int(rings[0, c]) for c in (26, 30, 34, 0, 4, 8, 12, 15, 17, 19, 21, 23)]
    inner = [int(rings[7, c]) for c in (26, 32, 0, 6, 12, 17, 19, 21)]
    return np.array(jaw + brows + bridge + base + eyes + outer + inner, np.int32)


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
