"""Places of the built-in head's mesh: smooth random fields, regions with soft edges, seams."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.errors import CaptureError
from elocute.head.model import HeadModel
from elocute.numerics.smoothing import smoothstep

CENTRES, REACH_M = 90, 0.013
"""How many bells random fields of the face are made of, and their standard deviation."""
MOUTH_CENTRES, MOUTH_REACH_M, MOUTH_M = 50, 0.0065, 0.024
"""The same around the mouth, which moves in finer detail, and how far that reaches."""
DETAIL = 0.5  # of the fine fields against the coarse ones
RIM_M = 0.030  # what lies so near the lower rim of the mesh hardly moves
RIGID = ("teeth", "gums", "tongue", "eyes")
FLIP = np.array([-1.0, 1.0, 1.0])


@dataclass(frozen=True, eq=False)
class FacePlaces:
    """What random fields and regions are made of, the same for every identity.

    Attributes
    ----------
    points
        (vertex, 3) m, the mean face.
    bells
        (vertex, centre): unit variance at any vertex for independent standard normal centres.
    soft
        (vertex,) 0 to 1: skin that may move by itself; 0 on bone, eyes, scalp and the rim.
    mirror
        (vertex,) the vertex on the other side.
    """

    points: Float64Array
    bells: Float64Array
    soft: Float64Array
    mirror: NDArray[np.integer]

    def noise(self, rng: np.random.Generator, channels: int) -> Float64Array:
        """(vertex, channel) smooth noise of unit variance."""
        return self.bells @ rng.normal(size=(self.bells.shape[1], channels))

    def bell(self, x_mm: float, y_mm: float, z_mm: float, width_mm: float) -> Float64Array:
        """(vertex,) 1 in the middle of a place, falling off with a standard deviation."""
        away = self.points - np.array([x_mm, y_mm, z_mm]) / 1000
        return np.exp(-0.5 * (away**2).sum(axis=1) / (width_mm / 1000) ** 2)


@lru_cache(maxsize=2)
def _places(name: str, mesh: _Mesh) -> FacePlaces:
    head = mesh.head
    points = head.template.astype(np.float64)
    face = points[head.regions["face"]]
    lips = points[np.unique(head.lip_rings)]
    near = np.sqrt(((face[:, None] - lips) ** 2).sum(axis=2).min(axis=1)) < MOUTH_M
    coarse = _bells(points, face, CENTRES, REACH_M)
    fine = _bells(points, face[near], MOUTH_CENTRES, MOUTH_REACH_M)
    bells = np.concatenate([coarse, DETAIL * fine], axis=1)
    bells /= np.sqrt((bells**2).sum(axis=1, keepdims=True) + 0.05)
    rim = points[head.regions["neck_rim"]]
    far = np.sqrt(((points[:, None] - rim) ** 2).sum(axis=2).min(axis=1))
    soft = smoothstep(np.clip(far / RIM_M, 0, 1))
    for region in RIGID:
        soft[head.regions[region]] = 0
    front = smoothstep(np.clip((points[:, 2] + 0.02) / 0.04, 0, 1))
    return FacePlaces(points, bells, soft * front, head.mirror)


def _bells(points: Float64Array, among: Float64Array, count: int, reach_m: float) -> Float64Array:
    """(vertex, centre) around centres far from each other; squares sum to one where they are."""
    centres = among[farthest_points(among, count)]
    away = ((points[:, None] - centres) ** 2).sum(axis=2)
    bells = np.exp(-0.5 * away / reach_m**2)
    return bells / np.sqrt((bells**2).sum(axis=1, keepdims=True) + 0.05)


class _Mesh:
    """A head by its name, so that what is made of it is kept."""

    def __init__(self, head: HeadModel) -> None:
        self.head = head

    def __hash__(self) -> int:
        return hash((self.head.name, self.head.vertex_count))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Mesh) and np.array_equal(self.head.template, other.head.template)


def face_places(head: HeadModel) -> FacePlaces:
    """The places of a head.

    Raises
    ------
    CaptureError
        For a head that does not name its regions, lips and mirrored vertices.
    """
    if not len(head.mirror) or not {"face", "neck_rim", "teeth"} <= set(head.regions):
        raise CaptureError.about(
            f"head {head.name!r}", found="names no regions", allowed="the built-in head"
        )
    return _places(head.name, _Mesh(head))


def farthest_points(points: Float64Array, count: int) -> NDArray[np.intp]:
    """(count,) indices of points far from each other, from the first on."""
    chosen = [0]
    nearest = ((points - points[0]) ** 2).sum(axis=1)
    while len(chosen) < count:
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, ((points - points[chosen[-1]]) ** 2).sum(axis=1))
    return np.array(chosen)


def screened_spread(
    points: Float64Array,
    edges: NDArray[np.integer],
    sources: NDArray[np.integer],
    reach_m: float,
) -> Float64Array:
    """How far what happens at some vertices is felt along the surface.

    Parameters
    ----------
    points
        (vertex, 3) m of a part of a mesh.
    edges
        (edge, 2) within it.
    sources
        (source,) vertices, each once.
    reach_m
        Where the influence has fallen to about a third.

    Returns
    -------
    (vertex, source): at a source 1 for itself and 0 for all others; elsewhere the solution of the
    screened Laplace equation, falling off with distance.
    """
    count = len(points)
    lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    stiff = 1 / np.maximum(lengths, 1e-4)
    matrix = np.zeros((count, count))
    for a, b in (edges.T, edges.T[::-1]):
        np.add.at(matrix, (a, b), -stiff)
        np.add.at(matrix, (a, a), stiff)
    mass = np.full(count, 1e-9)  # a vertex without neighbours has none
    for end in edges.T:
        np.add.at(mass, end, lengths / 2)
    matrix[np.diag_indices(count)] += mass / reach_m**2
    free = np.setdiff1d(np.arange(count), sources)
    spread = np.zeros((count, len(sources)))
    spread[sources, np.arange(len(sources))] = 1
    spread[free] = np.linalg.solve(matrix[np.ix_(free, free)], -matrix[np.ix_(free, sources)])
    return spread
