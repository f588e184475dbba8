"""Lines on a face that two meshes share: the edges of the lips and of the lids.

Each runs from the head's right to its left (increasing x) and is read at shares of its way, so
that a place on one mesh names the same place on the other.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array, IntArray
from elocute.errors import HeadError
from elocute.head.model import HeadModel


@dataclass(frozen=True, eq=False)
class EdgeGraph:
    """The edges of a mesh with their lengths."""

    points: Float64Array  # (vertex, 3) m
    triangles: IntArray  # (triangle, 3)

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

        lengths = dijkstra(
            self.lengths, directed=False, indices=sources, limit=limit, min_only=True
        )
        return np.asarray(lengths, np.float64)

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


Indices = NDArray[np.intp]
PLACES_MIN = 3  # on a line from corner to corner

LIPS = ("outer_upper", "outer_lower", "inner_upper", "inner_lower")
LIDS = ("lid_upper_right", "lid_lower_right", "lid_upper_left", "lid_lower_left")
LANDMARK_WAYS: dict[str, tuple[int, ...]] = {
    "outer_upper": (48, 49, 50, 51, 52, 53, 54),
    "outer_lower": (48, 59, 58, 57, 56, 55, 54),
    "inner_upper": (60, 61, 62, 63, 64),
    "inner_lower": (60, 67, 66, 65, 64),
    "lid_upper_right": (36, 37, 38, 39),
    "lid_lower_right": (36, 41, 40, 39),
    "lid_upper_left": (42, 43, 44, 45),
    "lid_lower_left": (42, 47, 46, 45),
}
"""The landmarks that each line passes, by increasing x; the middle one of a lip is its middle."""
MIDDLES = {"outer_upper": 51, "outer_lower": 57, "inner_upper": 62, "inner_lower": 66}


@dataclass(frozen=True, eq=False)
class FaceLine:
    """A line of vertices, with the shares of the way from corner to corner at which they lie."""

    vertices: Indices  # (place,) vertices, by increasing share
    # (place,) 0 to 1 along the line from corner to corner; a lip's middle is at one half
    shares: Float64Array
    corners: Float64Array  # (2, 3) m, where the line ends; not always vertices
    template: Float64Array  # (vertex, 3) m of the mesh

    @cached_property
    def _knots(self) -> tuple[Float64Array, Float64Array]:
        """Shares (knot,) and points (knot, 3), corners included."""
        inside = (self.shares > 0) & (self.shares < 1)
        points = self.template[self.vertices[inside]]
        return (
            np.r_[0.0, self.shares[inside], 1.0],
            np.concatenate([self.corners[:1], points, self.corners[1:]]),
        )

    def points(self, shares: Float64Array) -> Float64Array:
        """(share, 3) m: places along the line."""
        return interpolated(shares, *self._knots)

    def mixes(self, shares: Float64Array) -> tuple[Indices, Float64Array]:
        """Vertices (share, 2) and their weights (share, 2) whose mix lies at the given shares.

        Beyond the outermost vertices these stand for the corners.
        """
        places = np.interp(shares, self.shares, np.arange(len(self.shares), dtype=np.float64))
        below = np.clip(places.astype(np.intp), 0, max(len(self.shares) - 2, 0))
        above = np.minimum(below + 1, len(self.shares) - 1)
        weight = places - below
        return (
            np.stack([self.vertices[below], self.vertices[above]], axis=1),
            np.stack([1 - weight, weight], axis=1),
        )

    def read(self, values: Float64Array, shares: Float64Array) -> Float64Array:
        """(..., share, 3): vectors (..., vertex, 3) at places of the line."""
        vertices, weights = self.mixes(shares)
        return np.einsum("sk,...ska->...sa", weights, values[..., vertices, :])


def interpolated(at: Float64Array, knots: Float64Array, values: Float64Array) -> Float64Array:
    """(place, 3): linear between values (knot, 3) at rising knots."""
    return np.stack([np.interp(at, knots, values[:, axis]) for axis in range(3)], axis=1)


def lines_of_named_head(head: HeadModel) -> dict[str, FaceLine]:
    """The lines of a head that names its lips and the edges of its lids, as the built-in one."""
    points = head.template.astype(np.float64)
    lines: dict[str, FaceLine] = {}
    for name in LIPS:
        which, side = name.split("_")
        inner = getattr(head, f"{which}_lip_{side}").astype(np.intp)
        ends = getattr(head, f"{which}_corners").astype(np.intp)
        way = np.r_[ends[0], inner, ends[1]]
        lines[name] = _line(points, way, points[ends], int(head.landmarks[MIDDLES[name]]))
    for side in ("right", "left"):
        edges = {}
        for lid in ("upper", "lower"):
            edge = head.regions[f"lid_{lid}_{side}"].astype(np.intp)
            edges[lid] = edge[np.argsort(points[edge, 0])]
        ends = np.stack(
            [points[[edges["upper"][end], edges["lower"][end]]].mean(axis=0) for end in (0, -1)]
        )
        for lid, edge in edges.items():
            lines[f"lid_{lid}_{side}"] = _line(points, edge, ends)
    return lines


def lines_by_landmarks(
    points: Float64Array, graph: EdgeGraph, landmarks: Indices
) -> dict[str, FaceLine]:
    """The lines of a mesh: shortest ways along its edges through the 68 landmarks."""
    lines = {}
    for name, way in LANDMARK_WAYS.items():
        stops = landmarks[list(way)]
        vertices = graph.way_through(stops)
        middle = int(landmarks[MIDDLES[name]]) if name in MIDDLES else None
        lines[name] = _line(points, vertices, points[stops[[0, -1]]], middle)
    return lines


def _line(
    points: Float64Array, way: Indices, corners: Float64Array, middle: int | None = None
) -> FaceLine:
    """Shares along the straight line between the corners; what runs backwards is left out."""
    axis = corners[1] - corners[0]
    along = (points[way] - corners[0]) @ axis / (axis @ axis)
    if middle is not None:
        half = float((points[middle] - corners[0]) @ axis / (axis @ axis))
        along = np.interp(along, [0.0, half, 1.0], [0.0, 0.5, 1.0])
    along = np.clip(along, 0, 1)
    before = np.maximum.accumulate(np.r_[-1.0, along[:-1]])
    rising = along > before + 1e-6
    if rising.sum() < PLACES_MIN:
        raise HeadError.about(
            "landmarks", found="lips or lids without a length", allowed="iBUG's 68, in order"
        )
    return FaceLine(way[rising], along[rising], corners, points)
