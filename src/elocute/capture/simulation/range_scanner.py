"""A range scanner in software: cameras around a surface, what each sees, as one raw mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.one_line_repr import one_line

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
class RangeImage:
    """What one camera sees of a surface.

    Attributes
    ----------
    triangle
        (point,) fine triangle that a pixel shows.
    bary
        (point, 3) barycentric coordinates in it.
    ray
        (point, 3) unit direction from the camera.
    cell
        (point, 2) pixel.
    """

    triangle: NDArray[np.intp]
    bary: Float64Array
    ray: Float64Array
    cell: NDArray[np.intp]

    __repr__ = one_line


def render_range_images(
    points: Float64Array, triangles: NDArray[np.int32], spacing_m: float, jitter: Float64Array
) -> list[RangeImage]:
    """The parts of a surface that each camera faces best.

    Parameters
    ----------
    points, triangles
        (point, 3) m and (triangle, 3), the surface.
    spacing_m
        Width of a pixel.
    jitter
        (2,) shift of the pixel grids, in pixels.
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
    found = np.flatnonzero(hit["primID"] >= 0)
    u, v = hit["u"][found].astype(np.float64), hit["v"][found].astype(np.float64)
    bary = np.stack([1 - u - v, u, v], axis=1)
    return RangeImage(
        hit["primID"][found].astype(np.intp), bary, rays[found].astype(np.float64), cells[found]
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
