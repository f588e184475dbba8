"""The jaw's own path, and skin that slides over jaw and cheeks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float64Array, FloatArray
from elocute.head.model import HeadModel
from recipes.rich_faces.face_places import FacePlaces

JAW_FULL = 0.45  # weight of jawOpen at the widest in speech
CORNER_SLACK_M = 0.0005  # skin follows a corner of the mouth only beyond so much
JAW_SLACK_M = 0.0008
SLIDE_MAX_M = 0.004


@dataclass(frozen=True)
class JawPath:
    """How a jaw leaves the plain hinge as it opens, m and radians at a wide opening.

    aside is where the chin is half way, crooked where it ends; forward is the gliding of the joint.
    """

    aside: float
    crooked: float
    forward: float
    lean: float


def jaw_fields(head: HeadModel, points: Float64Array) -> Float64Array:
    """(3, vertex, 3) m per unit: the jaw to the left, forward, and leaning about +Z.

    Exactly rigid where skin weights are one, so teeth stay teeth.
    """
    share = head.skin_weights[:, head.joint_names.index("jaw")].astype(np.float64)[:, None]
    pivot = head.joint_positions[head.joint_names.index("jaw")]
    away = points - pivot
    lean = np.stack([-away[:, 1], away[:, 0], np.zeros(len(away))], axis=1)
    return np.stack([share * [1.0, 0, 0], share * [0, 0, 1.0], share * lean])


def jaw_weights(opening: Float64Array, path: JawPath) -> Float64Array:
    """(frame, 3) for `jaw_fields`, from the weight of jawOpen (frame,): a bent path."""
    share = opening / JAW_FULL
    aside = path.aside * np.sin(np.pi * np.clip(share, 0, 1.5)) + path.crooked * share**2
    forward = path.forward * share / (1 + np.abs(share))
    return np.stack([aside, forward, path.lean * np.tanh(share)], axis=1)


def slide_fields(
    head: HeadModel, places: FacePlaces, normals: FloatArray, amounts: Float64Array
) -> Float64Array:
    """(9, vertex, 3): skin that is drawn along the surface by the corners and by the chin.

    Each of three places has a field for x, y and z. amounts (3,) are for left corner, right corner
    and jaw; the skin over the jaw lags behind the bone, so its amount counts backwards.
    """
    left, right = (
        places.bell(side * 40, -58, 68, 17) + 0.6 * places.bell(side * 48, -36, 55, 18)
        for side in (1, -1)
    )
    jaw = places.bell(0, -95, 80, 15) + places.bell(30, -90, 60, 18) + places.bell(-30, -90, 60, 18)
    calm = places.soft * off_the_lips(head, places)
    fields = []
    for place, amount in zip((left, right, -jaw), amounts, strict=True):
        for axis in np.eye(3):
            along = axis - (normals @ axis)[:, None] * normals
            fields.append((amount * calm * place)[:, None] * along)
    return np.stack(fields)


def slide_weights(left: Float64Array, right: Float64Array, chin: Float64Array) -> Float64Array:
    """(frame, 9) m, from displacements (frame, 3) of both corners and of the chin.

    Skin sticks until it is drawn by more than a slack, and gives way by a few millimetres at most.
    """
    drawn = [
        _play(left, CORNER_SLACK_M),
        _play(right, CORNER_SLACK_M),
        _play(chin, JAW_SLACK_M),
    ]
    limited = [SLIDE_MAX_M * np.tanh(each / SLIDE_MAX_M) for each in drawn]
    return np.concatenate(limited, axis=1)


def _play(moved: Float64Array, slack: float) -> Float64Array:
    """Moves only where its input would leave it behind by more than a slack: friction."""
    at, out = np.zeros(3), np.empty_like(moved)
    for frame, now in enumerate(moved):
        at = np.clip(at, now - slack, now + slack)
        out[frame] = at
    return out


def off_the_lips(head: HeadModel, places: FacePlaces) -> Float64Array:
    """(vertex,) 0 on the lips, 1 from 8 mm away on."""
    lips = places.points[np.unique(head.lip_rings[:1])]
    inside = np.zeros(len(places.points), bool)
    inside[np.unique(head.lip_rings)] = True
    inside[head.regions["inner_mouth"]] = True
    far = np.sqrt(((places.points[:, None] - lips) ** 2).sum(axis=2).min(axis=1))
    return np.where(inside, 0, np.clip(far / 0.008, 0, 1))
