"""The body below the head's cut: MakeHuman's, its arms lowered, joined to the rim of the head."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from recipes.head.face import NeutralFace
from recipes.head.makehuman import MakeHuman
from recipes.head.pose import axis_rotation
from recipes.head.topology import SmoothSpread, limit_stencil
from recipes.looks.surface import Skin, subdivided

SHOULDER_DEG, ARM_DEG = 4.0, 27.0
"""How far MakeHuman's arms, which stand off, are lowered."""
HEM_M, ARM_M = 0.36, 0.30
"""The body ends this far below the eyes; what is further from the middle is hand and forearm."""
JOIN_M = 0.07
"""Within this of the rim the body gives way to the cut of the neck."""


def lowered(mh: MakeHuman, body: np.ndarray) -> np.ndarray:
    """A body whose arms hang."""
    posed = body.copy()
    for side, sign in (("L", -1), ("R", 1)):
        for bone, degrees in (("shoulder01", SHOULDER_DEG), ("upperarm01", ARM_DEG)):
            pivot = mh.joint(f"{bone}.{side}____head", posed)
            weights = sum(
                weight
                for name, weight in mh.bone_weights.items()
                if f"{bone}.{side}" in mh.ancestors(name)
            )
            turn = axis_rotation("Z", sign * degrees)
            turned = (posed - pivot) @ turn.T + pivot
            posed += np.asarray(weights)[:, None] * (turned - posed)
    return posed


class Torso:
    """The head's skin round the cut, and the body that goes on from it."""

    def __init__(self, face: NeutralFace) -> None:
        anatomy, mh = face.anatomy, face.mh
        body = lowered(mh, face.body)
        self.eye = face.assembly.eye_centre * [0, 1, 1]
        base = mh.base
        faces = base.quads[base.groups == "body"]
        above = np.setdiff1d(anatomy.skin_of_base, anatomy.rim_of_base)
        is_head = np.isin(faces, above).any(1)
        low = body[faces][..., 1].max(1) > self.eye[1] - HEM_M
        near = np.abs(body[faces][..., 0]).min(1) < ARM_M
        rim = body[anatomy.rim_of_base]
        by_rim = KDTree(rim).query(body[faces].mean(1))[0] < 0.09
        kept = np.where(is_head, by_rim, low & near)
        used, local = np.unique(faces[kept], return_inverse=True)
        self.quads = local.reshape(-1, 4)
        self.is_head = np.asarray(is_head)[kept]
        points = limit_stencil(self.quads, len(used)) @ body[used]
        edge = np.isin(used, self.open_rim(self.quads, used))
        points[edge] = body[used[edge]]
        own = anatomy.local[used]
        is_skin = np.greater_equal(own, 0)
        rim_local = np.searchsorted(used, anatomy.rim_of_base)
        cut = np.zeros_like(points)
        cut[is_skin] = face.skin[own[is_skin]] - points[is_skin]
        away = KDTree(points[rim_local]).query(points)[0]
        free = np.flatnonzero((away < JOIN_M) & ~is_skin)
        spread = SmoothSpread(self.quads, len(used), rim_local, free, alpha=0.002)
        moved = spread(cut[rim_local])
        moved[is_skin] = cut[is_skin]
        self.points = points + moved
        self.rim = rim_local
        self.plane = face.bust
        self.skin = Skin(self.points, self.quads)

    @staticmethod
    def open_rim(quads: np.ndarray, used: np.ndarray) -> np.ndarray:
        edges = np.sort(np.stack([quads, np.roll(quads, -1, 1)], -1).reshape(-1, 2), 1)
        pairs, count = np.unique(edges, axis=0, return_counts=True)
        return used[np.unique(pairs[count == 1])]

    def heights(self, points: np.ndarray) -> np.ndarray:
        """Over the plane of the cut, m."""
        return points @ self.plane.normal - self.plane.height

    def below(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The body below the rim, finer, and the vertices of its rim in order."""
        points, quads, edges = subdivided(self.points, self.quads)
        parent = np.repeat(self.is_head, 4)
        order = []
        for a, b in zip(self.rim, np.roll(self.rim, -1), strict=True):
            order += [int(a), edges[min(a, b), max(a, b)]]
        used, local = np.unique(quads[~parent], return_inverse=True)
        return points[used], local.reshape(-1, 4), np.searchsorted(used, order)


def hemmed(points, quads, rim, height: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut along a horizontal plane: vertices below it come up along their edges."""
    low = points[:, 1] < height
    quads = quads[~low[quads].all(1)]
    cut = points.copy()
    lift = np.full(len(points), -np.inf)
    for a, b in np.stack([quads, np.roll(quads, -1, 1)], -1).reshape(-1, 2).tolist():
        for down, up in ((a, b), (b, a)):
            if low[down] and not low[up] and points[up, 1] > lift[down]:
                lift[down] = points[up, 1]
                share = (height - points[down, 1]) / (points[up, 1] - points[down, 1])
                cut[down] = points[down] + share * (points[up] - points[down])
    alone = low & ~np.isfinite(lift)
    cut[alone, 1] = height
    used, local = np.unique(quads, return_inverse=True)
    return cut[used], local.reshape(-1, 4), np.searchsorted(used, rim)
