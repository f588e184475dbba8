"""A range scanner in software: cameras around a rounded surface, and what each sees of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.head.normals import vertex_normals
from elocute.one_line_repr import one_line

ROUNDNESS = 0.75  # of the surface between vertices; Boubekeur and Alexa's own choice
# yaw, pitch in degrees of orthographic cameras: none from behind, as in a capture booth.
CAMERAS = (
    (0.0, 0.0),
    (55.0, -8.0),
    (-55.0, -8.0),
    (105.0, 5.0),
    (-105.0, 5.0),
    (0.0, -50.0),
    (0.0, 55.0),
)
FACING_MIN = 0.25  # cosine to the viewing direction below which stereo fails
OVERLAP = 0.06  # cosine by which another camera may face a place better
STEP_MAX = 3.0  # depth from pixel to pixel, in pixels, beyond which there is an edge
RIM_M = 0.004
AWAY_M = 1.0


@dataclass(frozen=True, eq=False)
class Subdivision:
    """Triangles cut into parts², the same for every shape of a mesh.

    parent: (fine point,) the triangle it lies on. bary: (fine point, 3) barycentric coordinates in
    it. triangles: (fine triangle, 3) into fine points.
    """

    parent: NDArray[np.intp]
    bary: Float64Array
    triangles: NDArray[np.int32]

    __repr__ = one_line


def subdivide_triangles(triangles: NDArray[np.integer], parts: int) -> Subdivision:
    """Cut every triangle into parts² similar ones; points on shared edges are kept twice."""
    places = [(i, j) for i in range(parts + 1) for j in range(parts + 1 - i)]
    index = {place: number for number, place in enumerate(places)}
    small = []
    for i, j in places:
        if i + j < parts:
            small.append((index[i, j], index[i + 1, j], index[i, j + 1]))
        if i + j < parts - 1:
            small.append((index[i + 1, j], index[i + 1, j + 1], index[i, j + 1]))
    uv = np.array(places) / parts
    bary = np.column_stack([1 - uv.sum(axis=1), uv])
    count = len(triangles)
    fine = np.array(small)[None] + len(places) * np.arange(count)[:, None, None]
    return Subdivision(
        np.repeat(np.arange(count), len(places)),
        np.tile(bary, (count, 1)),
        fine.reshape(-1, 3).astype(np.int32),
    )


def phong_tessellation(
    vertices: NDArray[np.floating], triangles: NDArray[np.integer], where: Subdivision
) -> Float64Array:
    """(fine point, 3) m on the rounded surface through vertices (vertex, 3) m.

    A point of the flat triangle is drawn towards its projections onto the tangent planes at the
    three corners; corners stay where they are (Phong tessellation, Boubekeur and Alexa 2008).
    """
    vertices = vertices.astype(np.float64)
    normals = vertex_normals(vertices, triangles).astype(np.float64)
    corners = triangles[where.parent]
    flat = np.einsum("pc,pca->pa", where.bary, vertices[corners])
    rounded = np.zeros_like(flat)
    for corner in range(3):
        vertex = corners[:, corner]
        above = np.einsum("pa,pa->p", flat - vertices[vertex], normals[vertex])
        rounded += where.bary[:, corner, None] * (flat - above[:, None] * normals[vertex])
    return (1 - ROUNDNESS) * flat + ROUNDNESS * rounded


@dataclass(frozen=True, eq=False)
class RangeImage:
    """What one camera sees of a surface.

    triangle: (point,) fine triangle that a pixel shows. bary: (point, 3) barycentric coordinates in
    it. ray: (point, 3) unit direction from the camera. cell: (point, 2) pixel.
    """

    triangle: NDArray[np.intp]
    bary: Float64Array
    ray: Float64Array
    cell: NDArray[np.intp]

    __repr__ = one_line


def render_range_images(
    points: Float64Array, triangles: NDArray[np.int32], spacing_m: float, jitter: Float64Array
) -> list[RangeImage]:
    """The parts of a surface, points (point, 3) m and triangles, that each camera faces best.

    spacing_m: width of a pixel. jitter: (2,) shift of the pixel grids, in pixels.
    """
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene()
    corners = points[triangles]
    TriangleMesh(scene, np.ascontiguousarray(corners, np.float32))
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-20)
    rays = np.stack([_direction(yaw, pitch) for yaw, pitch in CAMERAS])
    facing = -(normals @ rays.T)  # (triangle, camera)
    best = facing.argmax(axis=1)
    seen = []
    for camera, ray in enumerate(rays):
        picture = _depth_camera(scene, points, ray, spacing_m, jitter)
        # A camera keeps what no other faces much better; so patches overlap by a little.
        kept = facing[picture.triangle, camera] > np.maximum(
            FACING_MIN, facing[picture.triangle, best[picture.triangle]] - OVERLAP
        )
        seen.append(
            RangeImage(
                picture.triangle[kept], picture.bary[kept], picture.ray[kept], picture.cell[kept]
            )
        )
    return seen


def _direction(yaw_deg: float, pitch_deg: float) -> Float64Array:
    """(3,) viewing direction of a camera at this yaw and pitch from the head's front."""
    yaw, pitch = np.radians(yaw_deg), np.radians(pitch_deg)
    return -np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])


def _depth_camera(
    scene: Any, points: Float64Array, ray: Float64Array, spacing_m: float, jitter: Float64Array
) -> RangeImage:
    right = np.cross(ray, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, ray)
    flat = points @ np.stack([right, up], axis=1)
    low, high = flat.min(axis=0), flat.max(axis=0)
    counts = np.ceil((high - low) / spacing_m).astype(int) + 1
    x, y = np.meshgrid(np.arange(counts[0]), np.arange(counts[1]))
    cells = np.stack([x.ravel(), y.ravel()], axis=1)
    at = low + (cells + jitter) * spacing_m
    origins = at @ np.stack([right, up]) - AWAY_M * ray
    origins += np.outer(np.full(len(at), float(points.mean(axis=0) @ ray)), ray)
    rays = np.ascontiguousarray(np.broadcast_to(ray, origins.shape), np.float32)
    hit = scene.run(origins.astype(np.float32), rays, output=True)
    hits = np.flatnonzero(hit["primID"] >= 0)
    u, v = hit["u"][hits].astype(np.float64), hit["v"][hits].astype(np.float64)
    bary = np.stack([1 - u - v, u, v], axis=1)
    return RangeImage(
        hit["primID"][hits].astype(np.intp), bary, rays[hits].astype(np.float64), cells[hits]
    )


def triangulate_range_image(
    seen: RangeImage, points: Float64Array, spacing_m: float, kept: NDArray[np.bool_]
) -> NDArray[np.int32]:
    """(triangle, 3) between neighbouring pixels on one surface.

    points (point, 3) m as measured; kept (point,) those that are used.
    """
    if not len(points):
        return np.zeros((0, 3), np.int32)
    width, height = seen.cell.max(axis=0) + 2
    grid = np.full((height, width), -1)
    places = np.flatnonzero(kept)
    grid[seen.cell[places, 1], seen.cell[places, 0]] = places
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, :-1], grid[1:, 1:]
    halves = [np.stack([a, b, c], axis=-1), np.stack([b, d, c], axis=-1)]
    triangles = np.concatenate([half.reshape(-1, 3) for half in halves])
    triangles = triangles[(triangles >= 0).all(axis=1)]
    corners = points[triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    return triangles[longest < STEP_MAX * spacing_m].astype(np.int32)
