"""A head as registration sees it: its surface, its smoothness, and a person's own neutral face."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.head.model import HeadModel
from elocute.numerics.ridge import ridge_coefficients
from elocute.registration.closest_points import (
    CoarseMesh,
    TriangleSamples,
    sample_triangles,
)
from elocute.registration.landmarks import JAW_LINE, Landmarks

UNSCANNED_MATERIALS = ("hair",)
"""Materials whose surface no scanner measures: brows and lashes stand on the skin."""
INNER_MATERIALS = ("mouth", "teeth", "gums", "tongue")
COTANGENT_MAX = 5.0
FACE_M, NOSE_TIP = 0.07, 30
PIXEL_M = 0.002
STILL_M, STILL_SHARE, STILL_LEAST = 1e-4, 0.99, 60
JAW_LINE_WEIGHT = 0.1
SIZE_STEP = 0.05
"""Share of a head's size: the standard deviation of adults'."""


@dataclass(frozen=True, eq=False)
class Template:
    """A head prepared for registration.

    Attributes
    ----------
    head
        Its template is the neutral face from which registration starts.
    mouth_shut
        Whether a scan is known to show nothing inside the mouth, as that of a resting face. What
        is inside is then no surface: a scan that lies across it would seem to be near the head.
    """

    head: HeadModel
    mouth_shut: bool = False

    @cached_property
    def triangles(self) -> NDArray[np.int32]:
        """(triangle, 3) of the surface that scans show."""
        names = self.head.material_names
        hidden = UNSCANNED_MATERIALS + (INNER_MATERIALS if self.mouth_shut else ())
        unseen = [index for index, name in enumerate(names) if name in hidden]
        return self.head.triangles[~np.isin(self.head.triangle_material, unseen)]

    @cached_property
    def triangle_samples(self) -> TriangleSamples:
        """Samples on the triangles, by which closest triangles are found."""
        return sample_triangles(self.vertices, self.triangles)

    @cached_property
    def rim(self) -> NDArray[np.bool_]:
        """(triangle, 3) whether the edge opposite each corner is on the rim of the surface."""
        after = np.roll(self.triangles, -1, axis=1).astype(np.int64)
        before = np.roll(self.triangles, 1, axis=1).astype(np.int64)
        keys = np.minimum(after, before) * self.head.vertex_count + np.maximum(after, before)
        _, place, count = np.unique(keys, return_inverse=True, return_counts=True)
        return (count == 1)[place].reshape(keys.shape)

    @cached_property
    def vertices(self) -> Float64Array:
        """(vertex, 3) m, the neutral face."""
        return self.head.template.astype(np.float64)

    def surface(self, vertices: Float64Array) -> CoarseMesh:
        """The template's surface in another shape (vertex, 3) m."""
        return CoarseMesh(vertices, self.triangles, self.triangle_samples)

    @cached_property
    def basis(self) -> Float64Array:
        """(expression, vertex, 3) m."""
        return self.head.expression_basis.astype(np.float64)

    @cached_property
    def identity_basis(self) -> Float64Array:
        """(identity, vertex, 3) m per standard deviation."""
        return self.head.identity_basis.astype(np.float64)

    @cached_property
    def skin(self) -> NDArray[np.intp]:
        """(free,) vertices that may leave the model: the connected part that bears the landmarks.

        Eyes, teeth and tongue are hardly measured: they stay with the model. A head without
        landmarks is free in its largest part.
        """
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components

        count = self.head.vertex_count
        a, b, c = self.head.triangles.T
        ones = np.ones(2 * len(a), np.int8)
        links = coo_matrix((ones, (np.r_[a, b], np.r_[b, c])), (count, count))
        _, label = connected_components(links, directed=False)
        bearing = self.head.landmarks if len(self.head.landmarks) else np.arange(count)
        return np.flatnonzero(label == np.bincount(label[bearing]).argmax())

    @cached_property
    def skin_index(self) -> NDArray[np.intp]:
        """(vertex,) index into `skin`, -1 for the others."""
        place = np.full(self.head.vertex_count, -1)
        place[self.skin] = np.arange(len(self.skin))
        return place

    @property
    def nose_tip(self) -> int:
        """The vertex at the tip of the nose: by the landmarks, or the foremost one."""
        if len(self.head.landmarks):
            return int(self.head.landmarks[NOSE_TIP])
        return int(self.skin[self.vertices[self.skin, 2].argmax()])

    @cached_property
    def open_face(self) -> NDArray[np.intp]:
        """(place,) vertices of the skin around the nose that every scan of a face must show.

        Not those in folds: nostrils, sockets of the eyes, the insides of lids and lips.
        """
        places = self.vertices[self.skin]
        near = np.linalg.norm(places - self.vertices[self.nose_tip], axis=1) < FACE_M
        fine = sample_triangles(self.vertices, self.triangles, PIXEL_M / 2)
        surface = fine.points(self.vertices, self.triangles)
        return self.skin[near & seen_from_front(places, surface, PIXEL_M)]

    @cached_property
    def still(self) -> NDArray[np.intp]:
        """(still,) vertices of the skin that tell the pose: no expression moves them, nor the neck.

        Those that expressions move least where there are few such.
        """
        head = self.head
        moved = np.linalg.norm(self.basis, axis=2).max(axis=0, initial=0.0)[self.skin]
        if "head" in head.joint_names:
            weights = head.skin_weights[self.skin, head.joint_names.index("head")]
            moved = np.where(weights > STILL_SHARE, moved, np.inf)
        few = np.partition(moved, STILL_LEAST)[STILL_LEAST] if len(moved) > STILL_LEAST else np.inf
        return self.skin[moved <= max(STILL_M, few)]

    @cached_property
    def skin_areas(self) -> Float64Array:
        """(free,) m²: a third of the triangles around each vertex of the skin."""
        triangles = self.skin_index[self.head.triangles]
        triangles = triangles[(triangles >= 0).all(axis=1)]
        a, b, c = (self.vertices[self.skin[triangles[:, corner]]] for corner in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6
        total = np.bincount(triangles.ravel(), np.repeat(area, 3), minlength=len(self.skin))
        return np.maximum(total, 1e-9).astype(np.float64)

    @cached_property
    def stretch_matrix(self) -> Any:
        """(free, free) sparse: Σ over edges of cotangent weight times squared difference."""
        from scipy.sparse import coo_matrix, diags

        triangles = self.skin_index[self.head.triangles]
        triangles = triangles[(triangles >= 0).all(axis=1)]
        corners = self.vertices[self.skin[triangles]]
        rows, columns, weights = [], [], []
        for corner in range(3):
            after, before = (corner + 1) % 3, (corner + 2) % 3
            u, v = corners[:, after] - corners[:, corner], corners[:, before] - corners[:, corner]
            area = np.linalg.norm(np.cross(u, v), axis=1)
            cotangent = np.einsum("ij,ij->i", u, v) / np.maximum(area, 1e-12)
            # Needles of the mesh would make the system worse, not the surface better.
            weights.append(np.clip(cotangent, 0.05, COTANGENT_MAX) / 2)
            rows.append(triangles[:, after])
            columns.append(triangles[:, before])
        count = len(self.skin)
        links = coo_matrix(
            (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))),
            (count, count),
        ).tocsr()
        links = links + links.T
        return (diags(np.asarray(links.sum(axis=1)).ravel()) - links).tocsc()

    @cached_property
    def bend_matrix(self) -> Any:
        """(free, free) sparse: ∫ |Δd|² over the skin, per m² of d: K M⁻¹ K of stretch matrix K."""
        from scipy.sparse import diags

        return (self.stretch_matrix @ diags(1 / self.skin_areas) @ self.stretch_matrix).tocsc()

    def landmark_weights(
        self, landmarks: Landmarks
    ) -> tuple[NDArray[np.intp], Float64Array, Float64Array]:
        """Vertices (landmark,), their measured places (landmark, 3) m and weights (landmark,).

        Only good landmarks; the jaw line counts a tenth. Empty for a head without landmarks.
        """
        if not len(self.head.landmarks):
            return np.zeros(0, np.intp), np.zeros((0, 3)), np.zeros(0)
        good = np.flatnonzero(landmarks.good)
        weights = landmarks.confidence[good].copy()
        weights[np.isin(good, JAW_LINE)] *= JAW_LINE_WEIGHT
        vertices = self.head.landmarks[good].astype(np.intp)
        return vertices, landmarks.points[good], weights


def with_size(head: HeadModel) -> HeadModel:
    """The head with its overall size as one more direction of identity, the last.

    People's heads differ in size by more than the others of a face's coefficients can say, and so
    do scans whose unit is only nearly known. One standard deviation is `SIZE_STEP` of the size.
    """
    middle = head.template.mean(axis=0)
    larger, apart = (
        SIZE_STEP * (head.template - middle),
        SIZE_STEP * (head.joint_positions - middle),
    )
    return replace(
        head,
        identity_basis=np.concatenate([head.identity_basis, larger[None]]).astype(np.float32),
        joint_identity_basis=np.concatenate([head.joint_identity_basis, apart[None]]).astype(
            np.float32
        ),
    )


def adaptive_template(
    template: Template, landmarks: Landmarks, *, regularisation: float = 1e-7
) -> tuple[Float64Array, Float64Array]:
    """The neutral face x with the expression that a scan's landmarks l show, and its weights c.

    x + U c (vertex, 3) m and c (expression,) by Eq. 1 of "Speech in the wild" (2019), c = argmin |l
    - A(x + U c)|², here with a ridge. landmarks: in the frame of the head (zero pose).
    regularisation: cost of a squared coefficient in m² of mean squared landmark distance.
    """
    vertices, places, weights = template.landmark_weights(landmarks)
    if not len(vertices):
        return template.vertices, np.zeros(len(template.basis))
    root = np.sqrt(weights / weights.sum())[:, None]
    slopes = (template.basis[:, vertices] * root).reshape(len(template.basis), -1)
    left = ((places - template.vertices[vertices]) * root).ravel()
    coefficients = ridge_coefficients(slopes, left, regularisation)
    return template.vertices + np.tensordot(coefficients, template.basis, 1), coefficients


YAWS_DEG = (-50.0, -25.0, 0.0, 25.0, 50.0)
DEPTH_PIXELS = 2.0
"""How far behind the foremost a point of a slanting surface may lie in one pixel."""


def seen_from_front(
    points: Float64Array, surface: Float64Array, pixel_m: float
) -> NDArray[np.bool_]:
    """(point,) whether nothing of a surface hides a point from one of five cameras far away.

    points: (point, 3) m of a head that faces +Z. surface: (sample, 3) m, closer to each other than
    a pixel.
    """
    seen = np.zeros(len(points), bool)
    for yaw in np.radians(YAWS_DEG):
        view = np.array([[np.cos(yaw), 0, -np.sin(yaw)], [0, 1, 0], [np.sin(yaw), 0, np.cos(yaw)]])
        here, all_of_it = points @ view.T, surface @ view.T
        low = np.minimum(here.min(axis=0), all_of_it.min(axis=0))[:2]
        own, cells = (((p[:, :2] - low) / pixel_m).astype(np.intp) for p in (here, all_of_it))
        across, up = np.maximum(own.max(axis=0), cells.max(axis=0)) + 1
        foremost = np.full(across * up, -np.inf)
        np.maximum.at(foremost, cells @ (up, 1), all_of_it[:, 2])  # many times as fast in one row
        seen |= here[:, 2] >= foremost[own @ (up, 1)] - DEPTH_PIXELS * pixel_m
    return seen
