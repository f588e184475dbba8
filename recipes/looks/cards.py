"""Cards fitted to the head: each vertex a fixed mixture of skin vertices and an offset."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from recipes.head.face import NeutralFace
from recipes.head.makehuman import Clothing, Mesh, read_clothing, read_obj

SKULL = ((5399, 11998), (791, 881), (962, 5320))
"""Pairs of the base mesh whose distances along x, y and z say how large a skull is."""
NEAREST = 3


@dataclass(frozen=True, eq=False)
class Cards:
    """As `elocute.head.looks.cards.Cards` reads them."""

    index: np.ndarray  # (vertex, 3) skin vertices
    weights: np.ndarray  # (vertex, 3), rows sum to one
    offset: np.ndarray  # (vertex, 3) m
    quads: np.ndarray
    uv: np.ndarray
    uv_quads: np.ndarray
    shade: np.ndarray  # (vertex,) 0..1
    points: np.ndarray  # (vertex, 3) m on the neutral face


class Fitting:
    """The neutral face, to which MakeHuman's clothes are fitted; then they hang on its skin."""

    def __init__(self, face: NeutralFace) -> None:
        self.face = face
        self.skin = face.skin
        self.local = face.anatomy.local
        self.tree = KDTree(self.skin)

    def skull(self) -> tuple[np.ndarray, np.ndarray]:
        """(3, 2) skin vertices, and (3,) m between them on the neutral face."""
        pairs = self.local[np.array(SKULL)]
        if (pairs < 0).any():
            raise ValueError("the skull's measures are no skin")
        between = [abs(self.skin[a, k] - self.skin[b, k]) for k, (a, b) in enumerate(pairs)]
        return pairs, np.array(between)

    def cards(self, folder: Path, name: str) -> Cards:
        fit, mesh = read_clothing(folder / f"{name}.mhclo"), read_obj(folder / f"{name}.obj")
        return self.bound(fit.fitted(self.face.body), mesh, fit)

    def bound(self, points: np.ndarray, mesh: Mesh, fit: Clothing | None = None) -> Cards:
        """Vertices hang on the skin that the fitting file names, or on the nearest."""
        index, weights = self.nearest(points)
        if fit is not None:
            own = self.local[fit.triangles]
            known = (own >= 0).all(1)
            index[known], weights[known] = own[known], fit.weights[known]
        offset = points - np.einsum("vk,vkc->vc", weights, self.skin[index])
        return Cards(
            index,
            weights,
            offset,
            mesh.quads,
            mesh.uv,
            mesh.uv_quads,
            np.ones(len(points)),
            points,
        )

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(n, NEAREST) skin vertices nearest to places, and their shares, which sum to one."""
        away, index = self.tree.query(points, NEAREST)
        near = 1 / np.maximum(away, 1e-5)
        return np.asarray(index), near / near.sum(1, keepdims=True)
