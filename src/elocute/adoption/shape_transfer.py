"""Transfers displacements from one face to another by correspondence.

Each vertex of the target takes the displacement of its place on the source, turned and scaled as
the source's skin around it was when it was laid over the target (after Sumner and Popovic 2004,
who carry whole deformation gradients). Where nothing corresponds, the field goes on smoothly.
What must meet is then held by equations: between the lips, and between the lids, the two sides
move apart on the target as they do on the source, so lips that seal there seal here.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.adoption.face import Face, Places
from elocute.array_types import Float64Array
from elocute.numerics.rigid_alignment import Similarity, nearest_rotation
from elocute.numerics.sparse_factor import factor_of

BEND_M = 0.0015
"""Length over which a carried displacement may bend against its neighbours."""
SPREAD_M = 0.004
"""Length over which lips that are closed at rest take the skin around them along."""
TIE_AREA_M2 = 2e-3
"""Area of skin that the equation of a pair counts for: far more than its vertices have."""
RINGS = 2
"""Neighbours of neighbours tell how the skin was turned and scaled."""
SCALE_RANGE = (0.5, 2.0)
SIDES = ("right", "left")


@dataclass(frozen=True, eq=False)
class Ties:
    """Pairs of places on a face that meet: one vertex, and a place on the line opposite."""

    # (pair, 3) the vertex, then the two vertices between which its opposite lies
    vertices: NDArray[np.intp]
    mixes: Float64Array  # (pair, 3) 1, then minus their weights
    shares: Float64Array  # (pair,) where along the line
    upward: Float64Array  # (pair,) 1 where the vertex is on the upper line, -1 on the lower one

    def apart(self, values: Float64Array) -> Float64Array:
        """(..., pair, 3): how far upper places are from lower ones, of vectors (..., vertex, 3)."""
        between = np.einsum("pk,...pka->...pa", self.mixes, values[..., self.vertices, :])
        return self.upward[:, None] * between


def ties_between(face: Face, upper: str, lower: str) -> Ties:
    """Pairs of two lines of a face; each vertex of both has one, but for the corners."""
    parts = []
    for name, other, upward in ((upper, lower, 1.0), (lower, upper, -1.0)):
        line, opposite = face.lines[name], face.lines[other]
        inside = (line.shares > 0.01) & (line.shares < 0.99)
        own, shares = line.vertices[inside], line.shares[inside]
        vertices, weights = opposite.mixes(shares)
        parts.append(
            (
                np.column_stack([own, vertices]),
                np.column_stack([np.ones(len(own)), -weights]),
                shares,
                np.full(len(own), upward),
            )
        )
    first, second = parts
    return Ties(*(np.concatenate([a, b]) for a, b in zip(first, second, strict=True)))


def apart_on(
    face: Face, upper: str, lower: str, values: Float64Array, shares: Float64Array
) -> Float64Array:
    """(..., share, 3): upper minus lower line of a face at shares, of vectors (..., vertex, 3)."""
    return face.lines[upper].read(values, shares) - face.lines[lower].read(values, shares)


@dataclass(frozen=True, eq=False)
class Transfer:
    """Everything between two faces that all shapes share."""

    source: Face
    target: Face
    laid: Float64Array  # (vertex, 3) m of the source, laid over the target
    similar: Similarity

    @cached_property
    def places(self) -> Places:
        """The place on the source of each vertex of the target's skin."""
        skin, rest = self.target.skin, self.target.surface()
        surface = self.source.surface(self.laid)
        return surface.places(self.target.points[skin], rest.normals[skin], self.target.sides[skin])

    @cached_property
    def frames(self) -> Float64Array:
        """(source vertex, 3, 3): scale times rotation of the source's skin around each vertex."""
        return local_similarities(self.source, self.laid, self.similar)

    @cached_property
    def target_frames(self) -> Float64Array:
        """(target free, 3, 3): the same at the vertices of the target's skin."""
        return self.places.read(self.frames)

    @cached_property
    def lips(self) -> Ties:
        return ties_between(self.target, "inner_upper", "inner_lower")

    @cached_property
    def lids(self) -> dict[str, Ties]:
        return {
            side: ties_between(self.target, f"lid_upper_{side}", f"lid_lower_{side}")
            for side in SIDES
        }

    @cached_property
    def all_ties(self) -> Ties:
        """Of the lips, then of the right and the left lids."""
        every = [self.lips, *(self.lids[side] for side in SIDES)]
        return Ties(
            *(
                np.concatenate([getattr(ties, name) for ties in every])
                for name in ("vertices", "mixes", "shares", "upward")
            )
        )

    @cached_property
    def _weights(self) -> Float64Array:
        return self.target.template.skin_areas * self.places.confidence

    @cached_property
    def _tie_rows(self) -> Any:
        """(pair, free) sparse: upper minus lower place."""
        from scipy.sparse import csr_matrix

        ties = self.all_ties
        columns = self.target.template.skin_index[ties.vertices]
        values = ties.mixes * ties.upward[:, None]
        starts = np.arange(len(columns) + 1) * columns.shape[1]
        return csr_matrix(
            (values.ravel(), columns.ravel(), starts), (len(columns), len(self.target.skin))
        )

    @cached_property
    def _factor(self) -> Any:
        from scipy.sparse import diags

        template = self.target.template
        matrix = BEND_M**4 * template.bend_matrix + 1e-12 * template.stretch_matrix
        matrix = matrix + diags(self._weights + 1e-9 * template.skin_areas)
        return factor_of((matrix + TIE_AREA_M2 * self._tie_rows.T @ self._tie_rows).tocsc())

    def at_places(self, shapes: Float64Array) -> Float64Array:
        """(shape, free, 3) m: displacements of the source (shape, vertex, 3) by correspondence."""
        turned = np.einsum("vab,svb->sva", self.frames, shapes)
        places = self.places
        return np.einsum("qc,sqca->sqa", places.bary, turned[:, places.corners])

    def smoothed(self, wanted: Float64Array, apart: Float64Array) -> Float64Array:
        """The smooth field (shape, free, 3) m nearest to displacements `wanted` (shape, free, 3) m.

        apart: (shape, pair, 3) m that is added between the two sides of `all_ties`.
        """
        side = self._weights[:, None] * wanted + TIE_AREA_M2 * np.stack(
            [self._tie_rows.T @ rows for rows in apart]
        )
        count = len(self.target.skin)
        solved = self._factor.solve(np.moveaxis(side, 1, 0).reshape(count, -1))
        return np.moveaxis(solved.reshape(count, len(wanted), 3), 0, 1)

    def spread(self, apart: Float64Array) -> Float64Array:
        """(shape, free, 3) m: the least field that adds (shape, pair, 3) m between pairs.

        It fades over the skin around, within some millimetres.
        """
        from scipy.sparse import diags

        template = self.target.template
        near = np.minimum(np.abs(self.target.sides[self.target.skin]), 1)
        held = template.skin_areas * (1 + 1e3 * (1 - near) ** 2)
        matrix = SPREAD_M**4 * template.bend_matrix + diags(held)
        factor = factor_of((matrix + TIE_AREA_M2 * self._tie_rows.T @ self._tie_rows).tocsc())
        side = TIE_AREA_M2 * np.stack([self._tie_rows.T @ rows for rows in apart])
        count = len(self.target.skin)
        solved = factor.solve(np.moveaxis(side, 1, 0).reshape(count, -1))
        return np.moveaxis(solved.reshape(count, len(apart), 3), 0, 1)

    def apart_as_on_source(self, shapes: Float64Array) -> Float64Array:
        """(shape, pair, 3) m: what the source's shapes add between its lips and its lids.

        Between the lips lengths are carried as they are around; between the lids they grow with
        the eye, so that what half shuts one eye half shuts the other.
        """
        parts = [
            self._carried_apart(self.lips, "inner_upper", "inner_lower", shapes),
            *(
                self._lid_ratio(side)
                * self._carried_apart(
                    self.lids[side], f"lid_upper_{side}", f"lid_lower_{side}", shapes
                )
                for side in SIDES
            ),
        ]
        return np.concatenate(parts, axis=1)

    def _carried_apart(
        self, ties: Ties, upper: str, lower: str, shapes: Float64Array
    ) -> Float64Array:
        apart = apart_on(self.source, upper, lower, shapes, ties.shares)
        return np.einsum("pab,spb->spa", self._pair_frames(ties), apart)

    def _pair_frames(self, ties: Ties) -> Float64Array:
        """(pair, 3, 3): the mean frame of the two sides of each pair."""
        rows = self.target.template.skin_index[ties.vertices]
        weights = np.abs(ties.mixes) / 2
        return np.einsum("pk,pkab->pab", weights, self.target_frames[rows])

    def _lid_ratio(self, side: str) -> float:
        """How much wider the target's eye is open, apart from its size."""
        ties, names = self.lids[side], (f"lid_upper_{side}", f"lid_lower_{side}")
        own = np.linalg.norm(ties.apart(self.target.points), axis=1).mean()
        rest = apart_on(self.source, *names, self.source.points, ties.shares)
        carried = np.einsum("pab,pb->pa", self._pair_frames(ties), rest)
        return float(own / max(float(np.linalg.norm(carried, axis=1).mean()), 1e-6))

    def shut_lids(self, side: str, blink: Float64Array) -> Float64Array:
        """(pair, 3) m that shut the target's eye as far as a blink (vertex, 3) shuts its own."""
        ties, names = self.lids[side], (f"lid_upper_{side}", f"lid_lower_{side}")
        left = apart_on(self.source, *names, self.source.points + blink, ties.shares)
        carried = np.einsum("pab,pb->pa", self._pair_frames(ties), left)
        return carried - ties.apart(self.target.points)


def local_similarities(source: Face, laid: Float64Array, similar: Similarity) -> Float64Array:
    """(vertex, 3, 3): what the neighbourhood of each vertex of the skin went through.

    Vertices off the skin have the similarity of the whole.
    """
    from scipy.sparse import identity

    skin, place = source.skin, source.template.skin_index
    edges = place[source.graph.edges]
    edges = edges[(edges >= 0).all(axis=1)]
    near: Any = identity(len(skin), format="csr") + _adjacency(edges, len(skin))
    around = near
    for _ in range(RINGS - 1):
        around = around @ near
    around.data[:] = 1
    counts = np.asarray(around.sum(axis=1))
    rest, moved = source.points[skin], laid[skin]
    outer = (moved[:, :, None] * rest[:, None, :]).reshape(-1, 9)
    mean_rest, mean_moved = (around @ rest) / counts, (around @ moved) / counts
    crossed = (around @ outer) / counts
    crossed = crossed.reshape(-1, 3, 3) - mean_moved[:, :, None] * mean_rest[:, None, :]
    spread = (around @ np.square(rest).sum(axis=1)) / counts[:, 0]
    spread = spread - np.square(mean_rest).sum(axis=1)
    rotations, most = nearest_rotation(crossed)
    scales = np.clip(most / np.maximum(spread, 1e-12) / similar.scale, *SCALE_RANGE) * similar.scale
    # Neighbours agree on what happened to them: one more mean takes the noise out.
    frames = (near @ (scales[:, None, None] * rotations).reshape(-1, 9)).reshape(-1, 3, 3)
    frames /= np.asarray(near.sum(axis=1)).reshape(-1, 1, 1)
    result = np.tile(similar.scale * similar.rotation, (len(source.points), 1, 1))
    result[skin] = frames
    return result


def _adjacency(edges: NDArray[np.intp], count: int) -> Any:
    from scipy.sparse import coo_matrix

    a, b = edges.T
    links = coo_matrix((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, a])), (count, count)).tocsr()
    links.data[:] = 1
    return links
