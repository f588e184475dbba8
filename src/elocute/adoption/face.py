"""A face as adoption needs it: skin, landmarks, lines of lips and lids, and places on it.

A place is where a point of another face belongs that was laid over it. Lips touch and roll inwards,
so the nearest point is often on the wrong lip or on the wrong side of the right one. Points are
therefore compared in seven dimensions: place, normal, and a number that is 1 on the upper lip, -1
on the lower one, and fades to 0 away from the mouth.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.adoption.face_lines import EdgeGraph, FaceLine, lines_by_landmarks, lines_of_named_head
from elocute.array_types import Float64Array, IntArray
from elocute.errors import HeadError
from elocute.head.model import HeadModel
from elocute.head.normals import vertex_normals
from elocute.registration.closest_points import closest_on_triangles, sample_triangles
from elocute.registration.template import Template

NORMAL_M = 0.008
"""A distance that counts as much as normals a radian apart."""
LIP_M = 0.012
"""A distance that counts as much as being on a lip and not on it."""
LIP_REACH_M = 0.015
LIP_BLEND_M = 0.004
SAMPLE_M = 0.002
CANDIDATES = 4
ON_EDGE = 1e-6


def lip_sides(graph: EdgeGraph, lines: dict[str, FaceLine]) -> Float64Array:
    """(vertex,) 1 on the upper lip, -1 on the lower one, fading to 0 at the corners and beyond."""
    away = []
    for name in ("inner_upper", "inner_lower"):
        line = lines[name]
        inside = (line.shares > 1e-3) & (line.shares < 1 - 1e-3)
        away.append(graph.distances(line.vertices[inside], limit=6 * LIP_REACH_M))
    upper, lower = (np.minimum(distance, 6 * LIP_REACH_M) for distance in away)
    side = np.clip((lower - upper) / LIP_BLEND_M, -1, 1)
    return side * np.exp(-np.square(np.minimum(upper, lower) / LIP_REACH_M))


@dataclass(frozen=True, eq=False)
class Places:
    """A place on a surface for each query point."""

    corners: IntArray  # (query, 3) vertices of its triangle
    bary: Float64Array  # (query, 3) barycentric coordinates
    points: Float64Array  # (query, 3) m
    distance_m: Float64Array  # (query,) how far it is
    facing: Float64Array  # (query,) cosine between the two normals
    # (query,) whether it lies on the surface's rim, where the point may belong beyond it
    on_rim: NDArray[np.bool_]

    def read(self, values: Float64Array) -> Float64Array:
        """(query, ...): values (vertex, ...) at the places."""
        return np.einsum("qc,qc...->q...", self.bary, values[self.corners])

    @property
    def confidence(self) -> Float64Array:
        """(query,) 0 to 1: near, and facing the same way."""
        near = np.exp(-np.square(self.distance_m / 0.002)) * ~self.on_rim
        return near * np.clip((self.facing - 0.3) / 0.4, 0, 1)


@dataclass(frozen=True, eq=False)
class LabelledSurface:
    """A surface that can be asked for the place that belongs to a point."""

    points: Float64Array  # (vertex, 3) m
    triangles: IntArray  # (triangle, 3)
    sides: Float64Array  # (vertex,) as `lip_sides` gives them

    @cached_property
    def normals(self) -> Float64Array:
        """(vertex, 3) unit normals."""
        return vertex_normals(self.points, self.triangles).astype(np.float64)

    @cached_property
    def rim(self) -> NDArray[np.bool_]:
        """(vertex,) whether it lies on an edge of one triangle only."""
        ends = np.concatenate(
            [self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]]
        )
        edges, counts = np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)
        result = np.zeros(len(self.points), bool)
        result[edges[counts == 1]] = True
        return result

    @cached_property
    def _samples(self) -> tuple[NDArray[np.intp], Any]:
        from scipy.spatial import KDTree

        samples = sample_triangles(self.points, self.triangles, SAMPLE_M)
        corners = self.triangles[samples.triangle]
        mixed = [
            np.einsum("sc,sca->sa", samples.bary, values[corners])
            for values in (self.points, self.normals, self.sides[:, None])
        ]
        return samples.triangle, KDTree(_features(*mixed), balanced_tree=False, compact_nodes=False)

    def places(self, points: Float64Array, normals: Float64Array, sides: Float64Array) -> Places:
        """The places that belong to points (query, 3) with normals and lip sides."""
        triangle, tree = self._samples
        _, near = tree.query(_features(points, normals, sides[:, None]), k=CANDIDATES)
        best = np.full(len(points), np.inf)
        corners = np.zeros((len(points), 3), np.intp)
        bary = np.zeros((len(points), 3))
        for column in range(CANDIDATES):
            tried = self.triangles[triangle[near[:, column]]]
            a, b, c = (self.points[tried[:, corner]] for corner in range(3))
            nearest = closest_on_triangles(points, a, b, c)
            place = nearest[:, :1] * a + nearest[:, 1:2] * b + nearest[:, 2:] * c
            squared = np.square(place - points).sum(axis=1)
            closer = squared < best
            best[closer], corners[closer], bary[closer] = (
                squared[closer],
                tried[closer],
                nearest[closer],
            )
        places = np.einsum("qc,qca->qa", bary, self.points[corners])
        there = np.einsum("qc,qca->qa", bary, self.normals[corners])
        there /= np.maximum(np.linalg.norm(there, axis=1, keepdims=True), 1e-12)
        facing = np.einsum("qa,qa->q", there, normals)
        on_rim = np.all((bary < ON_EDGE) | self.rim[corners], axis=1)
        return Places(corners, bary, places, np.sqrt(best), facing, on_rim)


def _features(points: Float64Array, normals: Float64Array, sides: Float64Array) -> Float64Array:
    return np.concatenate([points, NORMAL_M * normals, LIP_M * sides], axis=1)


@dataclass(frozen=True, eq=False)
class Face:
    """A head with landmarks, prepared for adoption."""

    # it has landmarks; where it names no lips, their lines are found through the landmarks
    head: HeadModel

    def __post_init__(self) -> None:
        if not len(self.head.landmarks):
            raise HeadError.about(
                f"head {self.head.name!r}", found="no landmarks", allowed="a head with 68 landmarks"
            )

    @cached_property
    def template(self) -> Template:
        return Template(self.head)

    @property
    def points(self) -> Float64Array:
        """(vertex, 3) m, at rest."""
        return self.template.vertices

    @property
    def skin(self) -> NDArray[np.intp]:
        """(free,) vertices of the part that bears the landmarks."""
        return self.template.skin

    @cached_property
    def triangles(self) -> NDArray[np.intp]:
        """(triangle, 3) of the skin."""
        inside = np.zeros(self.head.vertex_count, bool)
        inside[self.skin] = True
        return self.head.triangles[inside[self.head.triangles].all(axis=1)].astype(np.intp)

    @cached_property
    def graph(self) -> EdgeGraph:
        return EdgeGraph(self.points, self.head.triangles)

    @cached_property
    def lines(self) -> dict[str, FaceLine]:
        """The edges of lips and lids."""
        if len(self.head.inner_lip_upper) and "lid_upper_left" in self.head.regions:
            return lines_of_named_head(self.head)
        return lines_by_landmarks(self.points, self.graph, self.head.landmarks.astype(np.intp))

    @cached_property
    def sides(self) -> Float64Array:
        """(vertex,) upper lip 1, lower lip -1, 0 away from them."""
        return lip_sides(self.graph, self.lines)

    def surface(self, points: Float64Array | None = None) -> LabelledSurface:
        """The skin, at rest or in another shape (vertex, 3) m."""
        return LabelledSurface(
            self.points if points is None else points, self.triangles, self.sides
        )
