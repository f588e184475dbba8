"""Shortest paths and distances along the edges of a mesh."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array, IntArray
from elocute.errors import HeadError


@dataclass(frozen=True, eq=False)
class EdgeGraph:
    """The edges of a mesh with their lengths.

    Attributes
    ----------
    points
        (vertex, 3) m.
    triangles
        (triangle, 3).
    """

    points: Float64Array
    triangles: IntArray

    @cached_property
    def edges(self) -> NDArray[np.intp]:
        """(edge, 2) vertices, each edge once, the lower number first."""
        a, b, c = self.triangles.T.astype(np.intp)
        both = np.sort(np.stack([np.r_[a, b, c], np.r_[b, c, a]], axis=1), axis=1)
        return np.unique(both[both[:, 0] != both[:, 1]], axis=0)

    @cached_property
    def lengths(self) -> Any:
        """(vertex, vertex) sparse and symmetric, m."""
        from scipy.sparse import coo_matrix

        a, b = self.edges.T
        length = np.maximum(np.linalg.norm(self.points[a] - self.points[b], axis=1), 1e-9)
        count = len(self.points)
        return coo_matrix(
            (np.r_[length, length], (np.r_[a, b], np.r_[b, a])), (count, count)
        ).tocsr()

    @cached_property
    def parts(self) -> NDArray[np.intp]:
        """(vertex,) number of the connected part that it belongs to."""
        from scipy.sparse.csgraph import connected_components

        return connected_components(self.lengths, directed=False)[1].astype(np.intp)

    def distances(self, sources: NDArray[np.integer], limit: float = np.inf) -> Float64Array:
        """(vertex,) m along edges to the nearest source; infinite beyond the limit."""
        from scipy.sparse.csgraph import dijkstra

        found = dijkstra(self.lengths, directed=False, indices=sources, limit=limit, min_only=True)
        return np.asarray(found, np.float64)

    def way_through(self, stops: NDArray[np.integer]) -> NDArray[np.intp]:
        """Vertices of the shortest way along edges through stops, in this order.

        Raises HeadError where stops lie on separate parts.
        """
        from scipy.sparse.csgraph import dijkstra

        way = [int(stops[0])]
        for start, stop in itertools.pairwise(stops):
            _, before = dijkstra(
                self.lengths, directed=False, indices=int(start), return_predecessors=True
            )
            piece = [int(stop)]
            while piece[-1] != start:
                if before[piece[-1]] < 0:
                    raise HeadError.about(
                        "landmarks",
                        found="on separate parts of the mesh",
                        allowed="all on its skin",
                    )
                piece.append(int(before[piece[-1]]))
            way += piece[-2::-1]
        return np.array(way, np.intp)
