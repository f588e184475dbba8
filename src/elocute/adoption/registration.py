"""Lays the skin of a source head over another face, lips on lips and lids on lids.

Landmarks and the lines of lips and lids lead; then the surface follows the nearest places of the
other, ever less stiffly. What is minimised is free_offsets' energy, the bending of displacements,
with the lines held to the end: a face's features matter more here than its surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.adoption.face import Face
from elocute.adoption.face_lines import LIDS, LIPS
from elocute.array_types import Float64Array
from elocute.errors import HeadError
from elocute.head.normals import vertex_normals
from elocute.numerics.rigid_alignment import Similarity, similarity_between
from elocute.numerics.sparse_factor import factor_of

BENDS_M = (0.03, 0.02, 0.012, 0.008, 0.006, 0.005)
"""Lengths over which displacements may bend, step by step."""
REACH_M = (0.03, 0.02, 0.012, 0.008, 0.006, 0.006)
"""Distances beyond which a place is not believed."""
FACING = 0.5
GUIDE_AREA_M2 = 2e-4
"""Area of skin that a guiding point of weight one counts for."""
STRETCH_M = 3e-4
ANCHOR = 1e-4
FIT_MM = 12.0
"""Root mean square of the guides after a similarity beyond which landmarks are not a face's."""
LANDMARK_WEIGHTS = (
    (range(17), 0.02),
    (range(8, 9), 0.3),
    (range(17, 27), 0.1),
    (range(27, 36), 1.0),
)
"""Landmarks that guide besides the lines: the jaw and the brows lie where people set them."""


@dataclass(frozen=True, eq=False)
class Guides:
    """Vertices of the source, and where they belong on the target."""

    vertices: NDArray[np.intp]  # (guide,) of the source
    places: Float64Array  # (guide, 3) m, on the target
    weights: Float64Array  # (guide,) how much each counts


def guides_between(source: Face, target: Face) -> Guides:
    """Landmarks and the lines of lips and lids."""
    vertices, places, weights = [], [], []
    for landmarks, weight in LANDMARK_WEIGHTS:
        rows = list(landmarks)
        vertices.append(source.head.landmarks[rows].astype(np.intp))
        places.append(target.points[target.head.landmarks[rows]])
        weights.append(np.full(len(rows), weight))
    for name in (*LIPS, *LIDS):
        line = source.lines[name]
        vertices.append(line.vertices)
        places.append(target.lines[name].points(line.shares))
        weights.append(np.ones(len(line.vertices)))
    return Guides(np.concatenate(vertices), np.concatenate(places), np.concatenate(weights))


def lay_over(source: Face, target: Face) -> tuple[Float64Array, Similarity]:
    """The source's skin in the shape of the target's face, which is anywhere and of any size.

    Vertices (vertex, 3) m of the source, of which the skin lies on the target and the rest moved
    along by a similarity, which is returned too. Raises HeadError where the landmarks are not those
    of a face.
    """
    guides = guides_between(source, target)
    similar = similarity_between(source.points[guides.vertices], guides.places, guides.weights)
    start = similar(source.points)
    _check_fit(target, start[guides.vertices] - guides.places, similar.scale, guides.weights)
    current = start.copy()
    skin, place = source.skin, source.template.skin_index
    rows = place[guides.vertices]
    held = np.bincount(rows, GUIDE_AREA_M2 * guides.weights, len(skin)).astype(np.float64)
    pulled = np.stack(
        [
            np.bincount(rows, GUIDE_AREA_M2 * guides.weights * guides.places[:, axis], len(skin))
            for axis in range(3)
        ],
        axis=1,
    )
    goal = target.surface()
    matchable = ~np.isin(skin, source.head.regions.get("inner_mouth", np.zeros(0, np.int32)))
    areas = source.template.skin_areas
    current[skin] += _bent(source, BENDS_M[0], held, pulled - held[:, None] * current[skin])
    for bend_m, reach_m in zip(BENDS_M, REACH_M, strict=True):
        normals = vertex_normals(current, source.triangles).astype(np.float64)[skin]
        matched = goal.places(current[skin], normals, source.sides[skin])
        near = 1 / (1 + np.square(matched.distance_m / reach_m)) ** 2
        weights = areas * near * matchable * (matched.facing > FACING) * ~matched.on_rim
        total = weights + held
        wanted = weights[:, None] * matched.points + pulled
        # Offsets are counted from the similarity, so that what is bent is the whole change.
        offsets = _bent(source, bend_m, total, wanted - total[:, None] * start[skin])
        current[skin] = start[skin] + offsets
    return current, similar


def _check_fit(target: Face, left: Float64Array, scale: float, weights: Float64Array) -> None:
    """Raise HeadError where guides are far off in the size of the built-in head."""
    off_mm = 1000 * float(np.sqrt(weights @ np.square(left).sum(axis=1) / weights.sum())) / scale
    if not off_mm <= FIT_MM:
        raise HeadError.about(
            f"head {target.head.name!r}",
            found=f"landmarks {off_mm:.1f} mm off those of a face",
            allowed=f"up to {FIT_MM:g} mm",
        )


def _bent(face: Face, bend_m: float, weights: Float64Array, side: Float64Array) -> Float64Array:
    """(free, 3) m: offsets that bend least for weighted targets."""
    from scipy.sparse import diags

    template = face.template
    smooth = bend_m**4 * template.bend_matrix + STRETCH_M**2 * template.stretch_matrix
    matrix = smooth + diags(weights + ANCHOR * template.skin_areas)
    return factor_of(matrix.tocsc()).solve(side)
