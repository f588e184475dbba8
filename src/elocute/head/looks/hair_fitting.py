"""Fits hair to the shoulders and clothes it lies on, and moves it aside where cheeks come out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.head.looks.cards import Cards
from elocute.head.model import HeadModel
from elocute.head.normals import vertex_normals

LEAST_M, FREE_M, DEEP_M = 0.002, 0.006, 0.045
"""Heights over the cloth: hair that lies DEEP_M below it is lifted to LEAST_M above it, hair FREE_M
above it stays where it is, and hair between them keeps its order."""
BESIDE_M = 0.010
"""Hair that lies further to the side of a vertex of the cloth is not moved by it; from half of this
distance on, it is moved less."""
TIMES, AT_A_TIME = 2, 512
"""Passes over the hair, the second for hair that left the shirt and came into its collar; and how
many vertices are moved together, which bounds the memory."""
ASIDE_M = 0.03
"""Distance from the middle of the face beyond which skin counts as cheek: no brow or lip is
there."""
COMES_OUT_M = 0.004
"""A shape moves hair only where it pushes cheeks out by more than this."""
REACH_M, OFF_M = 0.025, 0.004
"""Distance from the cheeks within which hair is moved, and the distance from them that it keeps."""


def hair_on_clothes(hair: Cards, clothes: Cards, head: HeadModel) -> Cards:
    """Hair that lies on clothes, not in them; its offsets change where it was in the cloth or
    nearly so.

    Both are in the size of the bare head on which they hang.
    """
    points, cloth = hair.points(head.template), clothes.points(head.template)
    triangles = clothes.quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    normals = vertex_normals(cloth, triangles)
    low = np.flatnonzero(points[:, 1] < cloth[:, 1].max() + FREE_M)
    offset = hair.offset.copy()
    for start in range(0, len(low), AT_A_TIME):
        part = low[start : start + AT_A_TIME]
        for _ in range(TIMES):
            moved = _out_of(points[part], cloth, normals)
            points[part] += moved
            offset[part] += moved
    return hair.with_offset(offset)


def _out_of(points: Float32Array, cloth: Float32Array, normals: Float32Array) -> Float32Array:
    """(n, 3) m: how far points move, along the normals of the nearest vertices of the cloth."""
    nearest = ((cloth**2).sum(1) - 2 * points @ cloth.T).argmin(1)
    normal, away = normals[nearest], points - cloth[nearest]
    above = (away * normal).sum(1, keepdims=True)
    beside = np.linalg.norm(away - above * normal, axis=1, keepdims=True)
    wanted = np.interp(above, (-DEEP_M, FREE_M), (LEAST_M, FREE_M))
    share = np.clip(2 - 2 * beside / BESIDE_M, 0, 1)
    return np.asarray(share * np.maximum(wanted - above, 0) * normal, np.float32)


def hair_off_cheeks(dressed: HeadModel, hair: slice, head: HeadModel) -> HeadModel:
    """A head whose shapes also move hair that their cheeks would come through.

    `dressed` wears the hair, at the vertices of that slice; `head` is the same, bare: its first
    vertices.
    """
    normals = vertex_normals(head.template, head.triangles)
    out = np.einsum("svc,vc->sv", head.expression_basis, normals)
    skin = head.regions["skin"]
    beside = np.abs(head.template[skin, 0]) > ASIDE_M
    cheeks = skin[beside & (out[:, skin] > COMES_OUT_M).any(0)]
    shapes = np.flatnonzero((out[:, cheeks] > COMES_OUT_M).any(1))
    points = dressed.template[hair]
    near, nearest = _nearest(points, head.template[cheeks])
    if not len(near):
        return dressed
    under = cheeks[nearest]
    off = np.einsum("vc,vc->v", points[near] - head.template[under], normals[under])
    basis = dressed.expression_basis.copy()
    for shape in shapes:
        wanted = out[shape, under] - np.maximum(off - OFF_M, 0)
        already = np.einsum("vc,vc->v", basis[shape, hair][near], normals[under])
        more = np.maximum(wanted - np.maximum(already, 0), 0) * (off > -OFF_M)
        basis[shape, hair.start + near] += more[:, None] * normals[under]
    return replace(dressed, expression_basis=basis)


def _nearest(points: Float32Array, skin: Float32Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Which points lie near the skin, and which of its places each of them lies nearest to."""
    if not len(skin):
        return np.empty(0, np.intp), np.empty(0, np.intp)
    within = (points > skin.min(0) - REACH_M) & (points < skin.max(0) + REACH_M)
    near = np.flatnonzero(within.all(1))
    squares = (skin**2).sum(1) - 2 * points[near] @ skin.T
    nearest = squares.argmin(1)
    away = squares[np.arange(len(near)), nearest] + (points[near] ** 2).sum(1)
    kept = away < REACH_M**2
    return near[kept], nearest[kept]
