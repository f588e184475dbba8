"""Landmarks of a scan that comes with none, by a detector that takes pictures.

"Speech in the wild" (2019, 3.2): a 2D detector runs on a picture whose pixels are known in space.
Here the pictures are renders of the scan, textured or just shaded, from several sides; what the
detector finds is lifted through the mesh and fused so that one wrong view does no harm.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.capture.video.face_detector import mediapipe_detector
from elocute.capture.video.face_mesh_points import builtin_face_points
from elocute.errors import CaptureError
from elocute.head.builtin import load_builtin_head
from elocute.head.mediapipe_face_mesh import IRIS
from elocute.head.mesh import head_from_arrays
from elocute.head.model import HeadModel
from elocute.numerics.quaternions import to_matrices
from elocute.numerics.rigid_alignment import similarity_between
from elocute.registration.landmarks import LANDMARK_COUNT, Landmarks, no_landmarks
from elocute.registration.register import locate_head
from elocute.registration.scan import Scan, checked_scan
from elocute.render import Camera, open_renderer
from elocute.render.lights import RIGS
from elocute.render.stage import Stage

LandmarkDetector = Callable[[NDArray[np.uint8]], tuple[Float64Array, Float64Array] | None]
"""Takes a picture (height, width, 3) sRGB; gives points (68, 2) in pixels, x to the right and y
down, and confidence (68,) 0…1; None where it sees no face."""

YAWS_DEG = (0.0, -25.0, 25.0, -50.0, 50.0)
SIDE = 640
FIELD_DEG = 18.0
APART_M = 0.004
"""Views that agree on a landmark lie closer together than this."""
SINGLE = 0.5  # confidence kept by a landmark that only one view has seen
PLAUSIBLE_LEAST, PLAUSIBLE_STEPS = 8, 6
OFF_M = 0.010
"""From a face of average build: at this distance confidence has fallen to 0.37."""
NEIGHBOURS = 6
DOUBT_M = 0.008
"""From its nearest point to a landmark: at this distance confidence has fallen to 0.37."""

BROWS = range(17, 27)
BROW_SHARE = 0.3  # measured 11 mm off on scans whose brows have no hair; reported, but not used


def detect_landmarks(
    scan: Scan,
    detector: LandmarkDetector,
    *,
    yaws_deg: Sequence[float] = YAWS_DEG,
    side: int = SIDE,
) -> Landmarks:
    """The 68 landmarks of a scan in metres that stands about upright and looks along +Z.

    Confidence is that of the detector, times the share of views that agree, less where a point lies
    off a face aligned with all of them: through an open mouth a ray meets the throat. None is good
    where nothing is found: ask `enough`. yaws_deg: directions from which the scan is rendered.
    side: pixels of a picture's side. Raises CaptureError for a detector that returns anything but
    68 points.
    """
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene()
    TriangleMesh(scene, np.ascontiguousarray(scan.points[scan.triangles], np.float32))
    places, trusts = [], []
    for yaw in yaws_deg:
        camera = _view_camera(scan, yaw)
        detected = detector(_render_scan(scan, camera, side))
        if detected is None:
            continue
        pixels, confidence = _checked(*detected)
        space, facing = _lifted(scene, scan, camera, pixels, side)
        places.append(space)
        trusts.append(np.where(np.isfinite(space[:, 0]), confidence * facing, 0))
    return _plausible(_fused(np.stack(places), np.stack(trusts))) if places else no_landmarks()


def _view_camera(scan: Scan, yaw_deg: float) -> Camera:
    """A camera that frames the whole scan from a side."""
    low, high = scan.points.min(axis=0), scan.points.max(axis=0)
    target = (low + high) / 2
    distance = 0.55 * float(np.linalg.norm(high - low)) / np.tan(np.radians(FIELD_DEG) / 2)
    yaw = np.radians(yaw_deg)
    away = np.array([np.sin(yaw), 0.0, np.cos(yaw)])
    return Camera(
        (target + distance * away).astype(np.float32), target.astype(np.float32), FIELD_DEG
    )


def _render_scan(scan: Scan, camera: Camera, side: int = SIDE) -> NDArray[np.uint8]:
    """(side, side, 3) uint8 of the scan in its own colours, or shaded like skin."""
    head = head_from_arrays(scan.name, scan.points, scan.triangles)
    if scan.colors is not None:
        head = replace(head, vertex_color=scan.colors)
    stage = Stage(RIGS["even" if scan.colors is not None else "studio"], quality="high")
    with open_renderer(head, (side, side), camera=camera, stage=stage) as renderer:
        return renderer.frame(scan.points.astype(np.float32)).copy()


def _checked(pixels: Float64Array, confidence: Float64Array) -> tuple[Float64Array, Float64Array]:
    pixels, confidence = np.asarray(pixels, np.float64), np.asarray(confidence, np.float64)
    if pixels.shape != (LANDMARK_COUNT, 2) or confidence.shape != (LANDMARK_COUNT,):
        raise CaptureError(
            f"detector: found {pixels.shape} points and {confidence.shape} confidences; allowed: "
            f"({LANDMARK_COUNT}, 2) and ({LANDMARK_COUNT},)"
        )
    unknown = ~np.isfinite(pixels).all(axis=1) | ~np.isfinite(confidence)
    return np.where(unknown[:, None], 0, pixels), np.where(unknown, 0, np.clip(confidence, 0, 1))


def _lifted(
    scene: Any, scan: Scan, camera: Camera, pixels: Float64Array, side: int
) -> tuple[Float64Array, Float64Array]:
    """Points (68, 3) m under pixels, NaN in holes, and 0 to 1 how far they face the camera."""
    reach = np.tan(np.radians(camera.field_deg) / 2)
    across = (2 * pixels / side - 1) * reach * [1, -1]
    rays = np.column_stack([across, -np.ones(len(across))]) @ camera.axes().astype(np.float64)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    eyes = np.repeat(camera.position[None], len(rays), axis=0)
    hit = scene.run(np.ascontiguousarray(eyes, np.float32), rays.astype(np.float32), output=True)
    hits = hit["primID"] >= 0
    corners = scan.triangles[np.where(hits, hit["primID"], 0)]
    u, v = hit["u"][:, None], hit["v"][:, None]
    shares = np.concatenate([1 - u - v, u, v], axis=1)
    points = np.einsum("pc,pca->pa", shares, scan.points[corners])
    normals = np.einsum("pc,pca->pa", shares, scan.normals[corners])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    facing = np.clip(-np.einsum("pa,pa->p", normals, rays), 0, 1)
    return np.where(hits[:, None], points, np.nan), np.where(hits, facing, 0)


def _fused(places: Float64Array, trusts: Float64Array) -> Landmarks:
    """Of views (view, 68, 3) m with trust (view, 68): the mean of the largest group that agrees."""
    points, confidence = np.full((LANDMARK_COUNT, 3), np.nan), np.zeros(LANDMARK_COUNT)
    for mark in range(LANDMARK_COUNT):
        seen = np.flatnonzero(trusts[:, mark] > 0)
        if not len(seen):
            continue
        here, trust = places[seen, mark], trusts[seen, mark]
        near = np.linalg.norm(here[:, None] - here[None], axis=2) < APART_M
        group = near[int((near * trust).sum(axis=1).argmax())]
        share = trust[group] / trust[group].sum()
        points[mark] = share @ here[group]
        agreeing = trust[group].sum() / trust.sum()
        alone = SINGLE if group.sum() == 1 else 1.0
        confidence[mark] = min(1.0, trust[group].max()) * agreeing * alone
    return Landmarks(points, confidence)


def _plausible(detected: Landmarks) -> Landmarks:
    """Less confidence in points away from the built-in face, aligned with the rest of them."""
    known = np.flatnonzero(detected.confidence > 0)
    if len(known) < PLAUSIBLE_LEAST:
        return detected
    head = load_builtin_head()
    model, places = head.template[head.landmarks[known]].astype(float), detected.points[known]
    trust = detected.confidence[known]
    for _ in range(PLAUSIBLE_STEPS):
        off = np.linalg.norm(similarity_between(model, places, trust)(model) - places, axis=1)
        trust = detected.confidence[known] * np.exp(-np.square(off / OFF_M))
    confidence = detected.confidence.copy()
    confidence[known] = trust
    return Landmarks(detected.points, confidence)


@contextlib.contextmanager
def mediapipe_landmarks() -> Iterator[LandmarkDetector]:
    """A detector of 68 landmarks in single pictures, for `detect_landmarks`: MediaPipe's face mesh.

    Raises
    ------
    MachineError
        Where the extra `video` is missing.
    """
    shares, confidence = _landmark_shares()
    with mediapipe_detector(still=True) as see:

        def detect(picture: NDArray[np.uint8]) -> tuple[Float64Array, Float64Array] | None:
            faces = see(picture)
            if not len(faces):
                return None
            return shares @ faces.points[0, :, :2].astype(np.float64), confidence.copy()

        yield detect


@cache
def _landmark_shares() -> tuple[Float64Array, Float64Array]:
    """(68, 478) shares of points in each landmark, summing to one, and confidence (68,).

    On the built-in head both are known; the shares reproduce a landmark's place there from its
    nearest points, preferring the nearer ones.
    """
    head = load_builtin_head()
    points = builtin_face_points().on(head.template)[:IRIS]
    marks = head.template[head.landmarks].astype(np.float64)
    shares, confidence = np.zeros((len(marks), IRIS + 10)), np.zeros(len(marks))
    for row, mark in enumerate(marks):
        away = np.linalg.norm(points - mark, axis=1)
        near = np.argsort(away)[:NEIGHBOURS]
        cost = np.square(away[near]) + 1e-8
        # Least Σ cost·share² with Σ share = 1 and Σ share·point = mark, as seen from the front.
        rules = np.vstack([np.ones(NEIGHBOURS), 1000 * (points[near, :2] - mark[:2]).T])
        across = (rules / cost) @ rules.T + 1e-6 * np.eye(3)
        shares[row, near] = (rules / cost).T @ np.linalg.solve(across, [1.0, 0.0, 0.0])
        shares[row] /= shares[row].sum()
        confidence[row] = np.exp(-away[near[0]] / DOUBT_M)
    confidence[list(BROWS)] *= BROW_SHARE
    return shares, confidence


def find_landmarks(head: HeadModel, scan: Scan, detector: LandmarkDetector) -> Landmarks:
    """The 68 landmarks of a scan in metres, as a detector sees them in pictures of it.

    The scan is pictured as it stands; then without its colours, which may be wrong or blurred; then
    turned to where the search for a face sees it from the front. The first pictures that show
    enough of them tell; else the most that were seen: ask `enough`. Raises CaptureError for a scan
    that cannot be used, and a detector that gives anything else.
    """
    best = no_landmarks()
    scan, _ = checked_scan(scan)
    for rotation in _rotations(head, scan):
        turned = replace(scan, points=scan.points @ rotation)
        for pictured in _with_and_without_colours(turned):
            landmarks = detect_landmarks(pictured, detector)
            if landmarks.good.sum() > best.good.sum():
                best = Landmarks(landmarks.points @ rotation.T, landmarks.confidence)
            if best.enough:
                return best
    return best


def _with_and_without_colours(scan: Scan) -> Iterator[Scan]:
    yield scan
    if scan.colors is not None:
        yield replace(scan, colors=None)


def _rotations(head: HeadModel, scan: Scan) -> Iterator[Float64Array]:
    """(3, 3) as the scan stands; then the head's own, where a head is found."""
    yield np.eye(3)
    try:
        pose = locate_head(head, scan)
    except CaptureError:
        return
    yield np.asarray(to_matrices(pose.turns[:1])[0], np.float64)
