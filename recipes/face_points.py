"""Find where MediaPipe's 478 face points lie on the built-in head.

    python -m recipes.face_points            # writes the table that ships, and says its spread

The detector itself is asked: faces of the identity space are drawn from several sides, each
found point is cast back onto the drawn mesh, and the median over all pictures is kept as a place
in a triangle. Points of the lip contours and of the lids are then laid on the head's own lip
rings and lid edges, where a pixel more or less would be the other lip. Left and right are made
equal. Needs the extras `video` and `capture`; no data but the shipped head.
"""

from __future__ import annotations

import argparse
import io
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

from elocute.array_types import Float64Array, IntArray
from elocute.capture.video.face_detector import FaceDetector, mediapipe_detector
from elocute.capture.video.face_mesh_points import TABLE_PATH, FacePoints
from elocute.files.atomic import write_atomically
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import sample_identity
from elocute.head.mediapipe_face_mesh import IRIS, LIDS, LIP_CONTOURS, POINT_COUNT
from elocute.head.model import HeadModel
from elocute.registration.closest_points import CoarseMesh, sample_triangles
from elocute.render import open_renderer
from elocute.render.camera import Camera, portrait

SIDE = 640  # pixels
FACES = 24
VIEWS = ((0, 0), (0, -10), (0, 10), (-10, 0), (10, 0))  # yaw, pitch, degrees
NECK = 0.2  # share of the neck joint from which on skin is no face
FACING = 0.3  # cosine below which a sighting counts only where half of them are no better


def face_triangles(head: HeadModel) -> IntArray:
    """(triangle, 3) of skin, lips and eyes that move with the skull or the jaw, not the neck."""
    kinds = [head.material_names.index(name) for name in ("skin", "lips", "eyeball")]
    solid = head.triangles[np.isin(head.triangle_material, kinds)]
    on_neck = head.skin_weights[:, head.joint_names.index("neck")] > NECK
    return solid[~on_neck[solid].any(axis=1)]


def camera_at(head: HeadModel, yaw_deg: float, pitch_deg: float) -> Camera:
    """The portrait camera, walked around the head."""
    front = portrait(head)
    distance = float(np.linalg.norm(front.position - front.target))
    yaw, pitch = np.radians(yaw_deg), np.radians(pitch_deg)
    away = np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])
    return Camera((front.target + distance * away).astype(np.float32), front.target)


def rays_of(camera: Camera, pixels: Float64Array) -> Float64Array:
    """(point, 3) unit directions through pixels (point, 2) of a square picture."""
    reach = np.tan(np.radians(camera.field_deg) / 2)
    x, y = ((2 * pixels / SIDE - 1) * reach).T
    rays = np.stack([x, -y, -np.ones(len(x))], axis=1) @ camera.axes().astype(np.float64)
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def sight(
    one: HeadModel, rest: Float64Array, detect: FaceDetector, camera: Camera, solid: IntArray
) -> tuple[Float64Array, Float64Array]:
    """One picture of the face `one`: places (478, 3) on the mean face `rest`, and how squarely
    each is seen (478,); NaN and 0 where a point's ray misses the face."""
    import trimesh

    with open_renderer(one, (SIDE, SIDE), camera=camera) as renderer:
        faces = detect(renderer.frame(one.template))
    places, facing = np.full((POINT_COUNT, 3), np.nan), np.zeros(POINT_COUNT)
    if not len(faces):
        return places, facing
    rays = rays_of(camera, faces.points[0, :, :2].astype(np.float64))
    mesh = trimesh.Trimesh(one.template, solid, process=False)
    starts = np.repeat(camera.position[None].astype(np.float64), len(rays), axis=0)
    hits, ray, triangle = mesh.ray.intersects_location(starts, rays, multiple_hits=False)
    corners = one.template[solid[triangle]].astype(np.float64)
    bary = trimesh.triangles.points_to_barycentric(corners, hits)
    places[ray] = np.einsum("pc,pca->pa", bary, rest[solid[triangle]])
    facing[ray] = np.abs((mesh.face_normals[triangle] * rays[ray]).sum(axis=1))
    return places, facing


def sightings(head: HeadModel, solid: IntArray, faces: int) -> tuple[Float64Array, Float64Array]:
    """Places (picture, 478, 3) m, NaN where not seen well, and their median's spread (478,) mm."""
    rest = head.template.astype(np.float64)
    places, facing = [], []
    with mediapipe_detector(still=True) as detect:
        for seed in range(faces):
            one = head.with_identity(sample_identity(seed)) if seed else head
            for view in VIEWS:
                place, square = sight(one, rest, detect, camera_at(one, *view), solid)
                places.append(place)
                facing.append(square)
            print(f"face {seed + 1} of {faces}", file=sys.stderr)
    stacked, squarely = np.array(places), np.array(facing)
    stacked[squarely < np.minimum(FACING, np.median(squarely, axis=0))] = np.nan
    return stacked, squarely


def partners(head: HeadModel) -> IntArray:
    """(478,) the partner of each point on the other side, by a picture of the mean face."""
    with (
        open_renderer(head, (SIDE, SIDE), camera=portrait(head)) as renderer,
        mediapipe_detector(still=True) as detect,
    ):
        points = detect(renderer.frame(head.template)).points[0].astype(np.float64)
    flipped = (points - [SIDE / 2, 0, 0]) * [-1, 1, 1] + [SIDE / 2, 0, 0]
    partner = np.empty(POINT_COUNT, int)
    for part in (np.arange(IRIS), np.arange(IRIS, POINT_COUNT)):
        apart = np.linalg.norm(points[part][:, None] - flipped[part][None], axis=2)
        partner[part] = part[_assigned(apart)]
    if (partner[partner] != np.arange(POINT_COUNT)).any():
        raise SystemExit("the points of the left and the right side do not pair up")
    return partner


def _assigned(apart: Float64Array) -> IntArray:
    from scipy.optimize import linear_sum_assignment

    return linear_sum_assignment(apart)[1]


def on_lines(head: HeadModel) -> list[tuple[tuple[int, ...], IntArray]]:
    """Points of the detector, and the line of the head's vertices they lie on."""
    outer, inner = head.outer_corners, head.inner_corners
    lips = (
        (head.outer_lip_upper, outer),
        (head.outer_lip_lower, outer),
        (head.inner_lip_upper, inner),
        (head.inner_lip_lower, inner),
    )
    lines: list[tuple[tuple[int, ...], IntArray]] = [
        (contour, np.concatenate([ends[:1], middle, ends[1:]]))
        for contour, (middle, ends) in zip(LIP_CONTOURS, lips, strict=True)
    ]
    for name, points in LIDS.items():
        edge = head.regions[f"lid_{name}"]
        lines.append((points[1:-1], edge[np.argsort(head.template[edge, 0])]))
    return lines


def laid_on(line: Float64Array, places: Float64Array) -> tuple[IntArray, Float64Array]:
    """Closest places on a polyline (knot, 3): segment (place,) and share of it (place,)."""
    start, step = line[:-1], np.diff(line, axis=0)
    share = np.einsum("psa,sa->ps", places[:, None] - start, step) / (step**2).sum(axis=1)
    share = np.clip(share, 0, 1)
    apart = np.linalg.norm(places[:, None] - start - share[..., None] * step, axis=2)
    segment = apart.argmin(axis=1)
    return segment, share[np.arange(len(places)), segment]


def table(
    head: HeadModel, places: Float64Array, spread_mm: Float64Array, solid: IntArray
) -> FacePoints:
    """Places (478, 3) near the mean face as places in its triangles."""
    rest = head.template.astype(np.float64)
    attached = CoarseMesh(rest, solid, sample_triangles(rest, solid)).closest(places, near=4)
    vertices, shares = solid[attached.triangle].astype(np.int32), attached.bary
    for points, line in on_lines(head):
        index = np.array(points)
        segment, share = laid_on(rest[line], places[index])
        first, second = line[segment], line[segment + 1]
        vertices[index] = np.stack([first, second, second], axis=1)
        shares[index] = np.stack([1 - share, share, np.zeros(len(share))], axis=1)
    return FacePoints(vertices, shares.astype(np.float32), spread_mm.astype(np.float32))


def save_face_points(points: FacePoints, path: Path) -> None:
    """Write the table. Raises OutputError."""
    assert len(points.vertices) == POINT_COUNT
    packed = io.BytesIO()
    np.savez_compressed(
        packed,
        vertices=points.vertices.astype(np.int32),
        shares=points.shares.astype(np.float32),
        spread_mm=points.spread_mm.astype(np.float32),
    )
    with write_atomically(path) as draft:
        draft.write_bytes(packed.getvalue())


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--faces", type=int, default=FACES)
    options.add_argument("--output", type=Path, default=TABLE_PATH)
    given = options.parse_args()
    head = load_builtin_head()
    solid = face_triangles(head)
    places, _ = sightings(head, solid, given.faces)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # points that no picture shows
        median = np.nanmedian(places, axis=0)
        spread_mm = 1000 * np.nanmedian(np.linalg.norm(places - median, axis=2), axis=0)
    if not np.isfinite(median).all():
        raise SystemExit(f"never seen: {np.flatnonzero(~np.isfinite(median).all(axis=1))}")
    partner = partners(head)
    even = (median + median[partner] * [-1, 1, 1]) / 2
    moved_mm = 1000 * np.linalg.norm(even - median, axis=1)
    points = table(head, even, spread_mm, solid)
    laid_mm = 1000 * np.linalg.norm(points.on(head.template) - even, axis=1)
    # A point that is elsewhere on the other side, or beside the surface, is none to rely on.
    doubt = np.max([spread_mm, spread_mm[partner], 2 * moved_mm, 2 * laid_mm], axis=0)
    save_face_points(replace(points, spread_mm=doubt.astype(np.float32)), given.output)
    for name, values in (("spread", spread_mm), ("asymmetry", moved_mm), ("laid down", laid_mm)):
        print(f"{name}: median {np.median(values):.2f} mm, largest {values.max():.2f} mm")


if __name__ == "__main__":
    main()
