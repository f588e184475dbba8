"""Measures gaps and penetration of lips and teeth in millimetres, on any face.

Lips are cut by vertical planes from front to back, between the corners of the mouth. In each cut
both lips are outlines of ten points, from the vermilion border inwards. Seen from the front there
is an opening where the lowest point of the upper outline lies above the highest of the lower one; a
lip is in the other where points of its outline lie inside the other's. A lip is in a tooth where
its vertices lie inside the convex hull of a crown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array, Float64Array
from elocute.errors import HeadError
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion

PLANES = 13  # cuts through the mouth
REACH = 0.85  # of the half width, to either side: beyond it lips meet in the corners anyway
CROWNS = 14  # of each jaw
DIRECTIONS = 200  # in which hulls are measured, beside those across the crown's own faces
LIP_RINGS = 9  # that can touch teeth; the tenth lies in the cheek
CONES = (0.15, 0.05, 0.015)  # about the best direction so far, rad
CONTACT_RING = 7  # along which resting lips touch
FRAMES_AT_ONCE = 64


@dataclass(frozen=True)
class LipContact:
    """Lips of one face over time.

    Attributes
    ----------
    gap_mm : (frame,) float64
        Greatest opening between the lips seen from the front, mm; 0 or less where they are sealed.
    lip_depth_mm : (frame,) float64
        How deep one lip lies in the other at most, mm.
    tooth_depth_mm : (frame,) float64
        How deep a lip lies in a tooth at most, mm.
    """

    gap_mm: Float64Array
    lip_depth_mm: Float64Array
    tooth_depth_mm: Float64Array


def lip_contact(motion: Motion) -> LipContact:
    """Measure lips against each other and against the teeth of the face that moves.

    Parameters
    ----------
    motion : Motion
        On a head with lip rings and teeth, such as the built-in one; joint rotations are left out.

    Returns
    -------
    LipContact
        Of every frame.

    Raises
    ------
    HeadError
        For a head that does not say where its lips and teeth are.
    """
    head = motion.head
    _check(head)
    used, rings, crowns = _places(head)
    corners = _corner_columns(head)
    faces = _crown_faces(head, crowns, used)
    rest = head.template[used]
    basis = head.expression_basis[:, used].reshape(len(head.expression_names), -1)
    parts = []
    for first in range(0, motion.frame_count, FRAMES_AT_ONCE):
        weights = motion.weights[first : first + FRAMES_AT_ONCE]
        points = 1000 * ((weights @ basis).reshape(len(weights), len(used), 3) + rest)
        upper, lower = _sections(points[:, rings], corners)
        gap = (upper[..., 0].min(axis=-1) - lower[..., 0].max(axis=-1)).max(axis=-1)
        depth = np.maximum(_depth_in(lower, upper), _depth_in(upper, lower))
        lips = points[:, np.unique(rings[:LIP_RINGS])]
        parts.append((gap, depth, _tooth_depth(lips, points[:, crowns], faces)))
    return LipContact(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _check(head: HeadModel) -> None:
    """Raises HeadError for a head without lips or teeth."""
    missing = [] if len(head.lip_rings) else ["lips"]
    teeth = ("teeth_upper", "teeth_lower")
    if not all(len(head.regions.get(name, ())) for name in teeth):
        missing.append("teeth")
    if missing:
        raise HeadError.about(
            f"head {head.name!r}",
            found=f"no list of its {' and '.join(missing)}",
            allowed="a head that names both, such as the built-in one",
        )


def _places(
    head: HeadModel,
) -> tuple[NDArray[np.integer], NDArray[np.integer], NDArray[np.integer]]:
    """Vertices used; and among them the (ring, column) of lips and (crown, vertex) of teeth."""
    crowns = np.concatenate(
        [head.regions[f"teeth_{jaw}"].reshape(CROWNS, -1) for jaw in ("upper", "lower")]
    )
    every = np.concatenate([head.lip_rings.ravel(), crowns.ravel()])
    used, place = np.unique(every, return_inverse=True)
    lips, teeth = np.split(place.ravel(), [head.lip_rings.size])
    return used, lips.reshape(head.lip_rings.shape), teeth.reshape(crowns.shape)


def _corner_columns(head: HeadModel) -> tuple[int, int]:
    """Columns of the lip rings in the left and in the right corner of the mouth."""
    contact = head.template[head.lip_rings[CONTACT_RING], 0]
    return int(contact.argmax()), int(contact.argmin())


def _crown_faces(
    head: HeadModel, crowns: NDArray[np.integer], used: NDArray[np.integer]
) -> list[NDArray[np.integer]]:
    """Of each crown the faces of its mesh, (face, 4), as indices into the crown's vertices."""
    faces = []
    for crown in used[crowns]:
        place = np.full(head.vertex_count, -1)
        place[crown] = np.arange(len(crown))
        own = place[head.quads]
        faces.append(own[(own >= 0).all(axis=1)])
    return faces


def _sections(rings: Float32Array, corners: tuple[int, int]) -> tuple[Float64Array, Float64Array]:
    """(frame, plane, ring, 2) y and z of the upper and of the lower lip in each cut, mm.

    rings (frame, ring, column, 3): columns run from the middle of the upper lip to the left corner,
    along the lower lip to the right corner and back.
    """
    left, right = corners
    upper = np.concatenate([rings[:, :, right:], rings[:, :, : left + 1]], axis=2)
    lower = rings[:, :, left : right + 1][:, :, ::-1]
    contact = rings[:, CONTACT_RING]
    ends = contact[:, [right, left], 0].astype(np.float64)
    middle, half = ends.mean(axis=1), np.ptp(ends, axis=1) / 2
    planes = middle[:, None] + np.linspace(-REACH, REACH, PLANES) * half[:, None]
    return _cut(upper, planes), _cut(lower, planes)


def _cut(lip: Float32Array, planes: Float64Array) -> Float64Array:
    """(frame, plane, ring, 2) y and z where planes (frame, plane) at x cut each ring of a lip.

    lip (frame, ring, column, 3), by increasing x.
    """
    x = np.maximum.accumulate(lip[..., 0], axis=2)  # a ring that turns back at a corner
    behind = (x[:, None] <= planes[:, :, None, None]).sum(axis=3) - 1
    first = np.clip(behind, 0, lip.shape[2] - 2)  # (frame, plane, ring)
    frame = np.arange(len(lip))[:, None, None]
    ring = np.arange(lip.shape[1])
    start, stop = lip[frame, ring, first], lip[frame, ring, first + 1]
    run = x[frame, ring, first + 1] - x[frame, ring, first]
    share = (planes[:, :, None] - x[frame, ring, first]) / np.maximum(run, 1e-9)
    share = np.clip(share, 0, 1)[..., None]
    return ((1 - share) * start + share * stop)[..., 1:].astype(np.float64)


def _depth_in(points: Float64Array, outline: Float64Array) -> Float64Array:
    """(frame,) how deep points lie inside an outline at most, mm; 0 where none does.

    Both (frame, plane, ring, 2). The outline is closed through the flesh, from its last point to
    its first; depths are those below the surface, which that line is not part of.
    """
    start, stop = outline, np.roll(outline, -1, axis=2)
    p = points[:, :, :, None]
    a, b = start[:, :, None], stop[:, :, None]
    rise = b[..., 0] - a[..., 0]
    safe = np.where(np.abs(rise) < 1e-12, 1e-12, rise)
    crossing = a[..., 1] + (p[..., 0] - a[..., 0]) / safe * (b[..., 1] - a[..., 1])
    spans = (a[..., 0] > p[..., 0]) != (b[..., 0] > p[..., 0])
    inside = (spans & (p[..., 1] < crossing)).sum(axis=3) % 2 == 1
    along, offset = (b - a)[..., :-1, :], (p - a)[..., :-1, :]
    share = (offset * along).sum(axis=-1) / np.maximum((along**2).sum(axis=-1), 1e-12)
    nearest = offset - np.clip(share, 0, 1)[..., None] * along
    distance = np.linalg.norm(nearest, axis=-1).min(axis=3)
    return np.where(inside, distance, 0).max(axis=(1, 2))


def _tooth_depth(
    lips: Float32Array, crowns: Float32Array, faces: list[NDArray[np.integer]]
) -> Float64Array:
    """(frame,) how deep vertices lie inside a crown's convex hull at most, mm.

    lips (frame, vertex, 3), crowns (frame, crown, vertex, 3). A hull is what no direction sees
    beyond the crown's outermost vertex; the depth is the least over directions: those across the
    crown's own faces, many more, and then cones about the best.
    """
    low, high = crowns.min(axis=2), crowns.max(axis=2)
    within = np.ones((len(lips), crowns.shape[1], lips.shape[1]), np.bool_)
    for axis in range(3):
        at = lips[:, None, :, axis]
        within &= (at > low[:, :, None, axis]) & (at < high[:, :, None, axis])
    depth, spread = np.zeros(len(lips)), _directions()
    for frame, crown in np.argwhere(within.any(axis=2)):
        tooth = crowns[frame, crown]
        points = lips[frame, within[frame, crown]]
        directions = np.concatenate([_normals(tooth[faces[crown]]), spread])
        inside, nearest = _least_reach(points, tooth, directions)
        for cone in CONES:
            if inside.max() <= depth[frame]:
                break
            around = nearest[:, None] + cone * spread[::4]
            around /= np.linalg.norm(around, axis=2, keepdims=True)
            inside, nearest = _least_reach(points, tooth, np.concatenate([nearest, *around]))
        depth[frame] = max(depth[frame], float(inside.max()))
    return depth


def _least_reach(
    points: Float32Array, tooth: Float32Array, directions: Float32Array
) -> tuple[Float32Array, Float32Array]:
    """(point,) how far a tooth reaches beyond each at least, mm; (point, 3) which way."""
    beyond = (tooth @ directions.T).max(axis=0) - points @ directions.T
    best = beyond.argmin(axis=1)
    return beyond[np.arange(len(points)), best], directions[best]


def _normals(quads: Float32Array) -> Float32Array:
    """(face, 3) unit normals of quads (face, 4, 3), both ways round; none for empty faces."""
    across = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    length = np.linalg.norm(across, axis=1)
    known = across[length > 1e-9] / length[length > 1e-9, None]
    return np.concatenate([known, -known])


def _directions() -> Float32Array:
    """(direction, 3) unit vectors, evenly over the sphere: a spiral of golden angles."""
    index = np.arange(DIRECTIONS) + 0.5
    z, angle = 1 - 2 * index / DIRECTIONS, index * np.pi * (3 - np.sqrt(5))
    radius = np.sqrt(1 - z**2)
    spiral = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)
    return spiral.astype(np.float32)
