"""Makes a head that speaks of one scan of a person at rest: shape, colours, lips that seal.

The built-in head is registered to the scan; what moves it stays the built-in head's shapes. Lips
are joined as the built-in head's are, and the colours of the scan are baked into the picture of
the skin.
"""

from __future__ import annotations

import io
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.capture.scans import landmark_detection
from elocute.capture.scans.landmark_detection import find_landmarks
from elocute.corpus.length_units import fitting_unit, is_head_sized, longest_side
from elocute.errors import CaptureError, MachineError
from elocute.head.builtin import load_builtin_head
from elocute.head.looks.dressing import dress
from elocute.head.looks.look import Look
from elocute.head.model import HeadModel
from elocute.registration.landmarks import Landmarks, no_landmarks, read_landmarks
from elocute.registration.register import Registration, register_neutral
from elocute.registration.scan import Scan
from elocute.registration.scan_file import read_scan, unit_m

PIXELS = 1024
SAMPLES = 20
"""Along each side of a face: more than it has pixels."""
KNOWN_M = 0.006
"""Skin further from the scan than this was not seen."""
NEIGHBOURS = 4
FADE_PX = 10.0
"""Over how many pixels what was seen goes over into what was not."""


@dataclass(frozen=True, eq=False)
class ScannedHead:
    """The head of a person, in metres, and how well it lies on the scan.

    It has the built-in head's shapes and joints, and no identities.
    """

    head: HeadModel
    registration: Registration


def open_scanned_head(
    path: str | Path, landmarks: str | Path | None = None, unit: str | None = None
) -> ScannedHead:
    """Make a head that speaks of a scan's file, as `elocute.capture.read_scan` takes it.

    landmarks: the scan's 68 landmarks in its unit. Without them they are detected, if the extra
    `video` is installed; otherwise only the surface is used. unit: m, mm, cm, dm or inch; by
    default the one in which the scan has the size of a head. Raises CaptureError as `scanned_head`;
    for a file that is no scan, and of no size of a head.
    """
    scan = _scan_in_unit(Path(path), unit)
    if landmarks is not None:
        return scanned_head(scan, read_landmarks(landmarks, scan.unit_m))
    return scanned_head(scan, detected_landmarks(load_builtin_head(), scan))


def _scan_in_unit(path: Path, unit: str | None) -> Scan:
    """The scan in metres, from the unit that is told, or the one that fits a head."""
    if unit is not None:
        return read_scan(path, unit)
    scan = read_scan(path)
    size = longest_side(scan.points)
    fitting = "m" if is_head_sized(size) else fitting_unit(size)
    if not fitting:
        raise CaptureError.about(
            path,
            found=f"a size of {size:.4g}",
            allowed="a head in m, mm, cm, dm or inch",
            remedy="scale it to metres",
        )
    metres = unit_m(fitting)
    return replace(scan, points=metres * scan.points, unit_m=metres)


def detected_landmarks(head: HeadModel, scan: Scan) -> Landmarks:
    """Landmarks of a scan in metres as a detector sees them; none where there is no detector."""
    try:
        with landmark_detection.mediapipe_landmarks() as detector:
            landmarks = find_landmarks(head, scan, detector)
    except MachineError:
        return no_landmarks()
    return landmarks if landmarks.enough else no_landmarks()


def scanned_head(scan: Scan, landmarks: Landmarks) -> ScannedHead:
    """Make a head that speaks of a scan in metres of a person at rest, lips shut or a little apart.

    With too few good landmarks the face is searched for. Raises CaptureError for a scan without a
    face, and one on which the face is lost.
    """
    builtin = load_builtin_head()
    own, registration = register_neutral(builtin, scan, landmarks)
    if registration.lost:
        raise CaptureError.about(
            scan.name,
            found=f"a face that was lost ({registration.lost})",
            allowed="a scan of a whole face at rest",
            remedy="give its landmarks",
        )
    template = joined_lips(builtin, own.vertices).astype(np.float32)
    person = replace(
        own.head,
        name=scan.name,
        template=template,
        identity_basis=builtin.identity_basis[:0],
        joint_identity_basis=builtin.joint_identity_basis[:0],
        tone_basis=builtin.tone_basis[:0],
        trait_basis=builtin.trait_basis[:0],
        notice="",
    )
    bare = Look(hair="none", clothes="none", brows="none", lashes=0.0)
    plain = dress(person, bare, finer=False)
    if scan.colors is None:
        return ScannedHead(plain, registration)
    seen = baked_colors(plain, registration.vertices[: plain.vertex_count], scan)
    skin = replace(plain.surfaces["skin"], color=seen)
    return ScannedHead(replace(plain, surfaces={**plain.surfaces, "skin": skin}), registration)


def joined_lips(head: HeadModel, points: Float64Array) -> Float64Array:
    """Vertices (vertex, 3) m whose lips meet as those of the head's template do.

    Paired vertices of the line where lips meet move to their middle; each ring of the lips further
    out moves less.
    """
    moved = points.copy()
    rings = head.lip_rings
    innermost = rings[-1]
    target = points.copy()
    for upper, lower in zip(head.inner_lip_upper, head.inner_lip_lower, strict=True):
        apart = (head.template[upper] - head.template[lower]).astype(np.float64) / 2
        middle = (points[upper] + points[lower]) / 2
        target[upper], target[lower] = middle + apart, middle - apart
    shift = target[innermost] - points[innermost]
    for number, ring in enumerate(rings):
        moved[ring] = points[ring] + shift * (number / (len(rings) - 1))
    for vertex in (*head.inner_lip_upper, *head.inner_lip_lower):
        moved[vertex] = target[vertex]
    return moved


def baked_colors(head: HeadModel, points: Float64Array, scan: Scan) -> bytes:
    """The picture of the skin (PNG) in the colours of a scan.

    head: dressed; its own picture of the skin stays where the scan shows nothing. points: (vertex,
    3) m, its vertices where the scan was.
    """
    from PIL import Image
    from scipy.ndimage import distance_transform_edt, gaussian_filter
    from scipy.spatial import KDTree

    texels, places = _texels(head, points)
    away, nearest = KDTree(scan.points).query(places, NEIGHBOURS)
    assert scan.colors is not None
    share = 1 / np.maximum(away, 1e-6) ** 2
    share /= share.sum(axis=1, keepdims=True)
    shown = np.einsum("tk,tkc->tc", share, scan.colors[nearest].astype(np.float64))
    picture = np.zeros((PIXELS, PIXELS, 3))
    seen = np.zeros((PIXELS, PIXELS), bool)
    near = away[:, 0] < KNOWN_M
    picture[texels[near, 0], texels[near, 1]] = shown[near]
    seen[texels[near, 0], texels[near, 1]] = True
    nearest_seen = distance_transform_edt(~seen, return_distances=False, return_indices=True)
    rows, columns = np.asarray(nearest_seen)
    picture = picture[rows, columns]
    own = Image.open(io.BytesIO(head.surfaces["skin"].color)).convert("RGB")
    base = np.asarray(own.resize((PIXELS, PIXELS)), np.float64)
    base = base * (_mean(picture, seen) / np.maximum(_mean(base, seen), 1))
    cover = np.clip(2 * gaussian_filter(_closed(seen).astype(float), FADE_PX) - 1, 0, 1)[..., None]
    mixed = (cover * picture + (1 - cover) * base).clip(0, 255).astype(np.uint8)
    packed = io.BytesIO()
    Image.fromarray(mixed).save(packed, "JPEG", quality=92, subsampling=0)
    return packed.getvalue()


def _closed(seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels between seen ones count as seen, too."""
    from scipy.ndimage import binary_closing

    return np.asarray(binary_closing(seen, iterations=4), np.bool_)


def _mean(picture: Float64Array, seen: NDArray[np.bool_]) -> Float64Array:
    return picture[seen].mean(axis=0) if seen.any() else np.full(3, 128.0)


def _texels(head: HeadModel, points: Float64Array) -> tuple[NDArray[np.intp], Float64Array]:
    """(texel, 2) row and column in the picture of the skin, and (texel, 3) where each lies, m."""
    skin = head.material == head.material_names.index("skin")
    at = (np.arange(SAMPLES) + 0.5) / SAMPLES
    u, v = (axis.ravel() for axis in np.meshgrid(at, at))
    corners = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v])
    places = np.einsum("ks,qkc->qsc", corners, points[head.quads[skin]]).reshape(-1, 3)
    uv = np.einsum("ks,qkc->qsc", corners, head.uv[head.uv_quads[skin]].astype(np.float64))
    uv = uv.reshape(-1, 2)
    row = ((1 - uv[:, 1]) * PIXELS).astype(np.intp).clip(0, PIXELS - 1)
    column = (uv[:, 0] * PIXELS).astype(np.intp).clip(0, PIXELS - 1)
    _, first = np.unique(row * PIXELS + column, return_index=True)
    return np.stack([row[first], column[first]], axis=1), places[first]
