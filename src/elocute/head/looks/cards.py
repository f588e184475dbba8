"""Cards of hair, lashes and clothes: vertices that are fixed mixtures of the skin's, with offsets.

Every field of the skin carries over to them by the same mixture: the template, each basis, the
skin weights. So morphs, joints, identities and exports need no special case.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.head.looks import baked
from elocute.head.model import HeadModel

Int32Array = NDArray[np.int32]
MIN_MOVE_M = 1e-5
"""A shape that moves no root of a lash by more leaves it as it is."""


@dataclass(frozen=True, eq=False)
class Cards:
    """A mesh that hangs on the skin.

    Parameters
    ----------
    index : (vertex, k) int32
        Vertices of the head.
    weights : (vertex, k) float32
        Their shares; rows sum to one.
    offset : (vertex, 3) float32
        From the mixture, m.
    quads, uv, uv_quads : arrays
        As in HeadModel, counted from zero.
    shade : (vertex,) uint8
        Brightness, 255 = full.
    skull : (3, 2) int32
        Vertices whose distance along x, y and z says how large the head is.
    skull_m : (3,) float32
        Those distances on the face that the offsets were made for.
    around : (vertex, n) int32
        For what turns with the skin beside it: that skin; (vertex, 0) for what does not.
    covers : (covered,) int32
        Vertices of the head that lie under it and are not drawn.
    near : (near,) int32
        Vertices of the head that it keeps light from.
    near_light : (near,) uint8
        The light that it leaves them, 255 = all.
    """

    index: Int32Array
    weights: Float32Array
    offset: Float32Array
    quads: Int32Array
    uv: Float32Array
    uv_quads: Int32Array
    shade: NDArray[np.uint8]
    skull: Int32Array
    skull_m: Float32Array
    around: Int32Array
    covers: Int32Array
    near: Int32Array
    near_light: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.index)

    def scaled(self, factor: float) -> Cards:
        """The same with shorter or longer offsets."""
        return self.with_offset(self.offset * np.float32(factor))

    def with_offset(self, offset: Float32Array) -> Cards:
        """The same with other offsets, (vertex, 3) m."""
        return replace(self, offset=offset)

    def scaled_to(self, head: HeadModel) -> Cards:
        """The same with offsets in the size of a head's skull."""
        return self.with_offset(self.offset * self._skull_size(head))

    def _skull_size(self, head: HeadModel) -> Float32Array:
        points, axes = head.template, range(3)
        distances = [
            abs(points[a, k] - points[b, k]) for k, (a, b) in zip(axes, self.skull, strict=True)
        ]
        return (np.array(distances) / self.skull_m).astype(np.float32)

    def carried(self, field: Float32Array) -> Float32Array:
        """A field (..., vertex, column) of the head at these vertices."""
        mixed = 0.0
        for column in range(self.index.shape[1]):
            shares = self.weights[:, column, None]
            mixed = mixed + field[..., self.index[:, column], :] * shares
        return np.asarray(mixed, np.float32)

    def points(self, template: Float32Array) -> Float32Array:
        """(vertex, 3) m."""
        return self.carried(template) + self.offset

    def moved(self, template: Float32Array, basis: Float32Array) -> Float32Array:
        """(shape, vertex, 3): a basis of the head at these vertices."""
        moves = self.carried(basis)
        if self.around.shape[1]:
            moves = moves + self._turned(template, basis)
        return moves

    def _turned(self, template: Float32Array, basis: Float32Array) -> Float32Array:
        """How offsets turn with the skin beside them (Kabsch)."""
        turned = np.zeros((len(basis), len(self), 3), np.float32)
        roots, which = np.unique(self.index[:, 0], return_inverse=True)
        first = np.array([np.flatnonzero(which == k)[0] for k in range(len(roots))])
        around = self.around[first]
        moving = np.flatnonzero((np.abs(basis[:, roots]) > MIN_MOVE_M).any((1, 2)))
        rest = template[around] - template[around].mean(1, keepdims=True)
        for shape in moving:
            now = rest + basis[shape][around] - basis[shape][around].mean(1, keepdims=True)
            turns = _rotations(rest.astype(np.float64), now.astype(np.float64))
            turned[shape] = np.einsum("vij,vj->vi", turns[which], self.offset) - self.offset
        return turned


def _rotations(before: NDArray, after: NDArray) -> NDArray[np.float64]:
    """(n, 3, 3) that best turn each set of points (n, k, 3) into the other."""
    u, _, vt = np.linalg.svd(np.einsum("nki,nkj->nij", before, after))
    flip = np.ones((len(u), 3))
    flip[:, 2] = np.sign(np.linalg.det(u) * np.linalg.det(vt))
    return np.einsum("nji,nj,nkj->nik", vt, flip, u)


def read_cards(place: str) -> Cards:
    """Cards by their place among the assets ("hair/short01")."""
    stored = baked.arrays(place)
    count, none = len(stored["index"]), np.zeros(0, np.uint16)
    around = stored.get("around", np.zeros((count, 0), np.uint16))
    return Cards(
        index=stored["index"].astype(np.int32),
        weights=stored["weights"].astype(np.float32),
        offset=stored["offset"].astype(np.float32),
        quads=stored["quads"].astype(np.int32),
        uv=stored["uv"].astype(np.float32),
        uv_quads=stored["uv_quads"].astype(np.int32),
        shade=stored["shade"],
        skull=stored["skull"].astype(np.int32),
        skull_m=stored["skull_m"].astype(np.float32),
        around=around.astype(np.int32),
        covers=stored.get("covers", none).astype(np.int32),
        near=stored.get("near", none).astype(np.int32),
        near_light=stored.get("near_light", none).astype(np.uint8),
    )
