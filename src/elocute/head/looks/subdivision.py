"""Subdivides the mesh where pictures would show corners: face, lips, teeth, tongue and eyes.

Chosen faces of the built-in head are cut in four. The old vertices stay where they are, so what
holds for them (sealed lips, closed lids) goes on to hold; new ones lie on the cubic through their
neighbours (Dyn, Gregory and Levin, "A 4-point interpolatory subdivision scheme", 1987), those
within faces on Coons' patch of the edges. All are fixed mixtures of old ones, so that every
identity and expression moves them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.head.builtin import load_builtin_head
from elocute.head.looks.cards import read_cards
from elocute.head.looks.look import BROWS
from elocute.head.model import HeadModel

WHOLE, SKIN, PLACES = ("lips", "teeth", "tongue", "eyeball"), "skin", ("face", "lips")
"""Materials that are cut wherever they are, and where skin is."""
EYES = ("eye_left", "eye_right")
BENT_M = 0.00012
"""How far the middle of one of its sides must move for skin to be cut: more vertices cost time and
bytes, and do nothing for a cheek."""
TENSION = 1 / 16
"""Of the 4-point scheme: how far a new vertex follows the bend at either end of its edge."""
LONGEST = 2.0
"""Edges are of any length; one beyond counts as being as long as the one that is cut, but is
stretched no further than this."""
Indices = NDArray[np.intp]
WHOLE_FACE = np.array([[k, k] for k in range(4)])
QUARTERS = np.array([[[k, k], [k, (k + 1) % 4], [0, 2], [k - 1 & 3, k]] for k in range(4)])
"""Halfway between which corners of a face those of the whole, and of its quarters, lie."""
Corner = tuple[int, tuple[int, int]]
"""A vertex, and the two corners of the face halfway between which it lies."""


@dataclass(frozen=True, eq=False)
class Finer:
    """How chosen faces of a mesh are cut.

    Parameters
    ----------
    count : int
        Vertices of the mesh: new ones are counted on from it, those on edges first.
    ends : (edge, 2) intp
        The edges that are cut.
    beyond : (edge, 4) intp
        Where they go on: two vertices beyond the first end, two beyond the second.
    pull : (edge, 4) float32
        Shares of the bends there.
    corners : (face, 4) intp
        The faces that are cut.
    sides : (face, 4) intp
        Their edges; the first lies between the first two corners.
    """

    count: int
    ends: Indices
    beyond: Indices
    pull: Float32Array
    corners: Indices
    sides: Indices

    @property
    def more(self) -> int:
        """How many new vertices there are."""
        return len(self.ends) + len(self.corners)

    def between(self, field: NDArray[Any]) -> Float32Array:
        """Values (..., vertex, column) at the new vertices: means of the old ones'."""
        edges = field[..., self.ends, :].mean(-2, dtype=np.float32)
        faces = field[..., self.corners, :].mean(-2, dtype=np.float32)
        return np.concatenate([edges, faces], -2)

    def on_curves(self, points: Float32Array) -> Float32Array:
        """Places or movements (..., vertex, 3) of the new vertices."""
        edges = points[..., self.ends, :].mean(-2)
        for k in range(4):
            bend = points[..., self.ends[:, k // 2], :] - points[..., self.beyond[:, k], :]
            edges += self.pull[:, k, None] * bend
        faces = edges[..., self.sides, :].sum(-2) / 2 - points[..., self.corners, :].mean(-2)
        return np.concatenate([edges, faces], -2)

    def pieces(self, quads: NDArray[np.integer]) -> tuple[Indices, Indices, Indices]:
        """What some faces of the mesh (face, 4) are cut into; a triangle repeats its last vertex.

        Returns
        -------
        pieces : (piece, 4) intp
            Vertices. A face that is not chosen is cut into triangles where it borders on one.
        source : (piece,) intp
            The face that each is a piece of.
        halfway : (piece, 4, 2) intp
            The corners of that face halfway between which each corner of the piece lies.
        """
        middle, centre = self._middles(quads), self._centres(quads)
        cut = centre >= 0
        bordering = np.flatnonzero(~cut & (middle >= 0).any(1))
        whole = np.flatnonzero(~cut & (middle < 0).all(1))
        fans = [
            (face, piece)
            for face in bordering.tolist()
            for piece in _fan(quads[face].tolist(), middle[face].tolist())
        ]
        before = np.roll(middle, 1, axis=1)
        parts = (quads, middle, np.broadcast_to(centre[:, None], quads.shape), before)
        quarters = np.stack([part[cut] for part in parts], 2).reshape(-1, 4)
        pieces = [quads[whole], quarters, np.array([[v for v, _ in fan] for _, fan in fans])]
        source = [whole, np.flatnonzero(cut).repeat(4), np.array([face for face, _ in fans])]
        halfway = [
            np.broadcast_to(WHOLE_FACE, (len(whole), 4, 2)),
            np.tile(QUARTERS, (int(cut.sum()), 1, 1)),
            np.array([[ends for _, ends in fan] for _, fan in fans]),
        ]
        return (
            np.concatenate([each.reshape(-1, 4) for each in pieces]).astype(np.intp),
            np.concatenate(source).astype(np.intp),
            np.concatenate([each.reshape(-1, 4, 2) for each in halfway]).astype(np.intp),
        )

    def _middles(self, quads: NDArray[np.integer]) -> Indices:
        """(face, 4) vertices in the middles of edges, the first between the first two corners; -1
        where none is."""
        pairs = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], 2), axis=2)
        return self._found(self.ends, pairs, self.count)

    def _centres(self, quads: NDArray[np.integer]) -> Indices:
        """(face,) vertices in the middles of faces; -1 in those that are not cut in four."""
        first = self.count + len(self.ends)
        return self._found(self.corners, quads, first)

    def _found(self, known: Indices, wanted: NDArray[np.integer], first: int) -> Indices:
        row = _rows_of(_number(known, self.count), _number(wanted, self.count))
        return np.where(row < 0, -1, first + row)


def made_finer(head: HeadModel) -> HeadModel:
    """A head of the built-in mesh, perhaps without some of its faces, whose face is finer.

    It has the same vertices first and new ones after them: the same surface, rounder, but for the
    balls of the eyes, which are as smooth as those of the built-in head. The head that is given has
    the built-in head's vertices and no others.
    """
    finer = finer_face()
    head = replace(head, template=_evened(head))
    quads, source, halfway = finer.pieces(head.quads)
    at = np.sort(np.take_along_axis(head.uv_quads[source][:, None], halfway, 2), axis=2)
    ends, uv_quads = np.unique(_number(at, len(head.uv)), return_inverse=True)
    ends = np.stack([ends % len(head.uv), ends // len(head.uv)], 1)
    own = head.vertex_count + np.arange(finer.more, dtype=np.int32)
    color = np.round(finer.between(head.vertex_color)).astype(np.uint8)
    return replace(
        head,
        template=np.vstack([head.template, finer.on_curves(head.template)]),
        quads=quads.astype(np.int32),
        uv=head.uv[ends].mean(1),
        uv_quads=uv_quads.reshape(-1, 4).astype(np.int32),
        identity_basis=np.hstack([head.identity_basis, finer.on_curves(head.identity_basis)]),
        expression_basis=np.hstack([head.expression_basis, finer.on_curves(head.expression_basis)]),
        skin_weights=np.vstack([head.skin_weights, finer.between(head.skin_weights)]),
        material=head.material[source],
        vertex_color=np.vstack([head.vertex_color, color]),
        occlusion=np.r_[head.occlusion, finer.between(head.occlusion[:, None])[:, 0]],
        mirror=np.r_[head.mirror, own] if len(head.mirror) else head.mirror,
    )


def _evened(head: HeadModel) -> Float32Array:
    """(vertex, 3) m: a head whose eyes are the built-in head's, stretched and turned alike. Theirs
    are stored to some 0.03 mm, which is seen where a window is mirrored in them."""
    template, mean = head.template.copy(), load_builtin_head().template
    for eye in EYES:
        ball = head.regions[eye]
        of = np.column_stack([mean[ball], np.ones(len(ball))])
        template[ball] = of @ np.linalg.lstsq(of, head.template[ball], rcond=None)[0]
    return template


@cache
def finer_face() -> Finer:
    """How the built-in head is cut."""
    head = load_builtin_head()
    names = head.material_names
    chosen = np.isin(head.material, [names.index(name) for name in WHOLE])
    places = np.concatenate([head.regions[name] for name in PLACES])
    skin = head.material == names.index(SKIN)
    chosen |= skin & np.isin(head.quads, places).all(1)
    # Brows lie close on the skin, which would rise above them.
    under = np.concatenate([read_cards(f"brows/{name}").index.ravel() for name in BROWS])
    chosen &= ~np.isin(head.quads, under).any(1)
    chosen &= head.quads[:, 2] != head.quads[:, 3]
    chosen[chosen & skin] = _bends(_finer(head.quads, chosen & skin, head.template), head.template)
    return _finer(head.quads, chosen, head.template)


def _bends(finer: Finer, points: Float32Array) -> NDArray[np.bool_]:
    """(face,) whether a face is bent enough to be worth its pieces."""
    moved = (finer.on_curves(points) - finer.between(points))[: len(finer.ends)]
    return (np.linalg.norm(moved, axis=1)[finer.sides] > BENT_M).any(1)


def _finer(quads: NDArray[np.int32], chosen: NDArray[np.bool_], points: Float32Array) -> Finer:
    corners = quads[chosen].astype(np.intp)
    sides = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], 2), axis=2)
    ends, numbers = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    ways = _Ways(quads, len(points))
    beyond = np.concatenate([ways.straight_on(ends[:, ::-1]), ways.straight_on(ends)], 1)
    near = np.repeat(ends, 2, axis=1)
    length = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
    further = np.linalg.norm(points[near] - points[beyond], axis=2)
    pull = TENSION / 2 * np.minimum(length[:, None] / np.maximum(further, 1e-9), LONGEST)
    # Where an edge ends, it is drawn on straight: only the bend at its other end counts.
    pull[beyond == ends[:, [1, 1, 0, 0]]] *= -1
    shape = numbers.reshape(-1, 4)
    return Finer(len(points), ends, beyond, pull.astype(np.float32), corners, shape)


class _Ways:
    """Edges of a mesh in both directions, by number: face after face, corner after corner."""

    def __init__(self, quads: NDArray[np.int32], count: int) -> None:
        sides = np.where(quads[:, 2] == quads[:, 3], 3, 4)
        corner = np.arange(4) + np.zeros_like(quads)
        real = corner < sides[:, None]
        first = np.r_[0, np.cumsum(sides)[:-1]]
        self._begin = quads[real].astype(np.int64)
        after = first[:, None] + (corner + 1) % sides[:, None]
        before = first[:, None] + (corner - 1) % sides[:, None]
        self._end, self._before = self._begin[after[real]], before[real]
        self._count = count
        self._other = self._numbers(self._end, self._begin)
        self._edges = np.bincount(self._begin, minlength=count)
        rims = np.unique(np.r_[self._begin[self._other < 0], self._end[self._other < 0]])
        self._edges[rims] = 0

    def straight_on(self, edges: Indices) -> Indices:
        """(edge, 2): where edges (edge, 2) go on beyond their second vertex, by either way round
        it; their first vertex where the mesh ends or they meet no opposite edge."""
        start = self._numbers(edges[:, 1], edges[:, 0])
        around = self._edges[edges[:, 1]]
        places = []
        for steps in (around // 2, around - around // 2):
            way = start
            for step in range(int(steps.max())):
                turned = self._other[self._before[way]]
                way = np.where(step < steps, turned, way)
            known = (around > 2) & (start >= 0)
            places.append(np.where(known, self._end[way], edges[:, 0]))
        return np.stack(places, 1)

    def _numbers(self, begin: NDArray[np.integer], end: NDArray[np.integer]) -> Indices:
        """(edge,) of edges by their vertices; -1 where no face has them in that direction."""
        own, wanted = np.stack([self._begin, self._end], 1), np.stack([begin, end], 1)
        return _rows_of(_number(own, self._count), _number(wanted, self._count))


def _fan(quad: list[int], middles: list[int]) -> Iterator[list[Corner]]:
    """The pieces of a face of which some edges have middles."""
    sides = 3 if quad[2] == quad[3] else 4
    middles = middles if sides == 4 else [middles[0], middles[1], middles[3]]
    outline: list[Corner] = []
    for k in range(sides):
        outline.append((quad[k], (k, k)))
        if middles[k] >= 0:
            outline.append((middles[k], (k, (k + 1) % sides)))
    # From a new vertex on: no triangle is then a sliver along a cut edge.
    start = next(k for k, (_, (one, two)) in enumerate(outline) if one != two)
    outline = outline[start:] + outline[:start]
    while len(outline) > 4:
        yield [outline[0], outline[1], outline[2], outline[2]]
        del outline[1]
    yield outline if len(outline) == 4 else [*outline, outline[2]]


def _number(rows: NDArray[np.integer], count: int) -> Indices:
    """(...,) one number for each row (..., n) of indices below a count."""
    return rows.astype(np.int64) @ (count ** np.arange(rows.shape[-1], dtype=np.int64))


def _rows_of(known: Indices, wanted: Indices) -> Indices:
    """(...,) the row of `known` (row,) that has each number of `wanted` (...,), or -1."""
    order = np.argsort(known)
    at = order[np.minimum(np.searchsorted(known, wanted, sorter=order), len(known) - 1)]
    return np.where(known[at] == wanted, at, -1)
