"""Ray casting with Embree: needs no system library. Slower, the same look."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.export.render import shading
from elocute.export.render.camera import Camera
from elocute.head.model import HeadModel
from elocute.head.normals import vertex_normals

# Where edges need it, a pixel is the mean of four more rays (a rotated grid).
GRID = ((0.125, 0.375), (0.375, -0.125), (-0.125, -0.375), (-0.375, 0.125))
EDGE = 0.06  # difference of neighbouring pixels (0…1) that counts as an edge


class RayRenderer:
    """One head, one camera."""

    def __init__(self, head: HeadModel, size: tuple[int, int], camera: Camera) -> None:
        import embreex  # noqa: F401  said here, not at the first frame

        self._size = size
        self._triangles = np.ascontiguousarray(head.triangles, np.int32)
        self._surfaces = shading.vertex_surfaces(head)
        self._glossy = shading.glossy_triangles(head)
        self._eye = camera.position
        self._axes = camera.axes()
        self._reach = np.tan(np.radians(camera.field_deg) / 2)
        width, height = size
        rows = (shading.background(height)).astype(np.float32)
        self._back = np.broadcast_to(rows[:, None], (height, width, 3)).reshape(-1, 3)

    def frame(self, points: Float32Array) -> NDArray[np.uint8]:
        """(height, width, 3) picture of vertices (vertex, 3) m."""
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        width, height = self._size
        scene = EmbreeScene()
        TriangleMesh(scene, np.ascontiguousarray(points[self._triangles], np.float32))
        normals = vertex_normals(points, self._triangles)
        skin = shading.shade_vertices(points, normals, self._surfaces, self._eye)
        everywhere = np.arange(width * height)
        colors = self._cast(scene, skin, normals, everywhere, (0.0, 0.0))
        edges = self._edges(colors.reshape(height, width, 3))
        more = [self._cast(scene, skin, normals, edges, offset) for offset in GRID]
        colors[edges] = np.mean(more, axis=0)
        return (colors.reshape(height, width, 3) * 255 + 0.5).astype(np.uint8)

    def _cast(
        self,
        scene: Any,
        skin: Float32Array,
        normals: Float32Array,
        pixels: NDArray[np.intp],
        offset: tuple[float, float],
    ) -> Float32Array:
        """Colours (pixel, 3) of rays through pixels (flat indices), moved by part of a pixel."""
        width, height = self._size
        x = (pixels % width + 0.5 + offset[0]) / width * 2 - 1
        y = 1 - (pixels // width + 0.5 + offset[1]) / height * 2
        local = np.stack(
            [x * self._reach * width / height, y * self._reach, -np.ones(len(pixels))], axis=1
        )
        rays = (local @ self._axes).astype(np.float32)
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        eyes = np.repeat(self._eye[None].astype(np.float32), len(rays), axis=0)
        hit = scene.run(eyes, rays, output=True)
        found = np.flatnonzero(hit["primID"] >= 0)
        colors = self._back[pixels].copy()
        if len(found):
            faces = hit["primID"][found]
            u, v = hit["u"][found], hit["v"][found]
            shares = np.stack([1 - u - v, u, v], axis=1).astype(np.float32)[:, :, None]
            corners = self._triangles[faces]
            colors[found] = (skin[corners] * shares).sum(axis=1)
            gloss = self._glossy[faces]
            normal = (normals[corners[gloss]] * shares[gloss]).sum(axis=1)
            normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
            surface = (self._surfaces[corners[gloss]] * shares[gloss]).sum(axis=1)
            colors[found[gloss]] = shading.shade(normal, -rays[found[gloss]], surface)
        return colors

    @staticmethod
    def _edges(picture: Float32Array) -> NDArray[np.intp]:
        """Flat indices of pixels that differ from a neighbour."""
        across = np.abs(np.diff(picture, axis=1)).max(axis=2) > EDGE
        down = np.abs(np.diff(picture, axis=0)).max(axis=2) > EDGE
        edge = np.zeros(picture.shape[:2], bool)
        edge[:, 1:] |= across
        edge[:, :-1] |= across
        edge[1:] |= down
        edge[:-1] |= down
        return np.flatnonzero(edge)

    def __enter__(self) -> RayRenderer:
        return self

    def __exit__(self, *_: object) -> None:
        pass
