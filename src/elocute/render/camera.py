"""Places the camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float32Array
from elocute.errors import InputError
from elocute.head.model import HeadModel
from elocute.one_line_repr import brief
from elocute.render.backends_and_views import FRAMINGS, VIEWS
from elocute.render.lights import Rig
from elocute.render.shading import box

ROOM = 1.12  # of the head's ball, for jaws that open and heads that turn
BLUR_M = 0.0048  # standard deviation of the blur
REACH = 2.2  # taps end at this many of them
FIELD_DEG = 18.0  # vertical field of view: a portrait lens
MARGIN = 1.06
WITHOUT_NECK = 0.03  # what ends this near below its chin is shown to its end, m
FOREHEAD, BELOW_CHIN = 0.62, 0.22  # of the distance from eyes to chin, above and below a face
SIDES = {"head": 1.12, "face": 0.8}  # of the head's width, kept in the picture


@dataclass(frozen=True)
class Camera:
    """A camera that looks at a point.

    Parameters
    ----------
    position : (3,) float32
        Where it stands, m.
    target : (3,) float32
        What it looks at, m.
    field_deg : float
        Vertical field of view, degrees.
    """

    position: Float32Array
    target: Float32Array
    field_deg: float = FIELD_DEG

    def axes(self) -> Float32Array:
        """(3, 3) rows: right, up, back."""
        back = self.position - self.target
        back = back / np.linalg.norm(back)
        right = np.cross([0.0, 1.0, 0.0], back)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(back, right), back]).astype(np.float32)

    def matrix(self, aspect: float) -> Float32Array:
        """(4, 4) world to clip space."""
        axes = self.axes()
        look = np.eye(4)
        look[:3, :3], look[:3, 3] = axes, -axes @ self.position
        distance = float(np.linalg.norm(self.position - self.target))
        near, far = 0.4 * distance, 2.0 * distance
        focal = 1 / np.tan(np.radians(self.field_deg) / 2)
        lens = np.zeros((4, 4))
        lens[0, 0], lens[1, 1] = focal / aspect, focal
        lens[2, 2], lens[2, 3] = (far + near) / (near - far), 2 * far * near / (near - far)
        lens[3, 2] = -1
        return (lens @ look).astype(np.float32)


def portrait(
    head: HeadModel, view: str = "front", *, framing: str = "head", aspect: float = 1.0
) -> Camera:
    """A camera that frames a head with some of its neck, its face, or the mouth alone.

    Parameters
    ----------
    head : HeadModel
        What is framed.
    view : str
        A key of `VIEWS`: "front", "three-quarter", "side" or "mouth".
    framing : str
        "head", or "face": from the hairline to below the chin.
    aspect : float
        Width by height of the picture; in a tall one the camera steps back until the head is not
        cut at its sides.

    Returns
    -------
    Camera

    Raises
    ------
    InputError
        For an unknown view or framing.
    """
    for kind, value, known in (("view", view, VIEWS), ("framing", framing, FRAMINGS)):
        if not isinstance(value, str) or value not in known:
            raise InputError.about(
                f"{kind} {brief(value)}", found="unknown", allowed=", ".join(known)
            )
    yaw_deg, pitch_deg, share = VIEWS[view]
    framed = head.template[head.regions.get("framed", slice(None))]
    high = framed.max(axis=0)
    skin = head.regions.get("skin", slice(None))  # clothes end lower and lie further in front
    low, front = head.template[skin, 1].min(), head.template[skin, 2].max()
    # The bust below the chin fills the frame's foot; the crown keeps some air.
    top = high[1] + 0.02
    known = _chin_and_eyes(head)
    chin, eyes = known or (low, high[1])
    bottom = max(low + 0.015, chin - 0.075)
    if known and chin - low < WITHOUT_NECK:
        bottom = low - 0.02
    if framing == "face" and known:
        top, bottom = eyes + FOREHEAD * (eyes - chin), chin - BELOW_CHIN * (eyes - chin)
    target = np.array([0.0, (top + bottom) / 2, front - 0.1])
    if view == "mouth" and len(head.lip_rings):
        target = head.template[head.lip_rings[0]].mean(axis=0)
    height = (top - bottom) * share * MARGIN
    if view != "mouth":
        # Shoulders may be cut, the head may not.
        shown = framed[(framed[:, 1] > chin) & (framed[:, 1] < top)]
        wide = np.ptp(shown[:, 0]) if len(shown) else 0.0
        height = max(height, SIDES[framing] * wide * MARGIN / aspect)
    distance = height / 2 / np.tan(np.radians(FIELD_DEG) / 2)
    yaw, pitch = np.radians(yaw_deg), np.radians(pitch_deg)
    away = np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])
    return Camera((target + away * distance).astype(np.float32), target.astype(np.float32))


def _chin_and_eyes(head: HeadModel) -> tuple[float, float] | None:
    """How high these are, m; None for a head that does not say."""
    places = head.landmarks[8:9], head.landmarks[36:48]
    if not len(head.landmarks):  # others' characters have regions for it
        if "chin" not in head.regions:
            return None
        places = head.regions["chin"], head.regions["eyes"]
    chin, eyes = (float(head.template[each, 1].mean()) for each in places)
    return chin, eyes


@dataclass(frozen=True)
class ShadowView:
    """An orthographic view along the key."""

    # (4, 4) head space to -1…1; z is the depth, from -1 at the key's side
    matrix: Float32Array
    radius: float  # half the side of what it sees, m

    def taps(self, side: int) -> list[tuple[float, float]]:
        """(offset in pixels, share) of a Gauss kernel on a map of `side` pixels.

        Pairs of pixels are one tap between them, as linear filtering gives it.
        """
        sigma = BLUR_M * side / (2 * self.radius)
        count = max(1, int(np.ceil(REACH * sigma)))
        weights = np.exp(-0.5 * (np.arange(count + 2) / sigma) ** 2)
        taps = [(0.0, float(weights[0]))]
        for near in range(1, count + 1, 2):
            pair = weights[near] + weights[near + 1]
            offset = near + weights[near + 1] / pair
            taps += [(offset, float(pair)), (-offset, float(pair))]
        total = sum(weight for _, weight in taps)
        return [(float(offset), weight / total) for offset, weight in taps]


def shadow_view(head: HeadModel, rig: Rig) -> ShadowView:
    """The view of the key on a head."""
    low, high = head.template.min(axis=0), head.template.max(axis=0)
    middle = (low + high) / 2
    radius = ROOM * float(np.linalg.norm(head.template - middle, axis=1).max())
    towards, right, above = box(rig.lamps[0])
    axes = np.stack([right, above, -towards]).astype(np.float64) / radius
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, -axes @ middle
    return ShadowView(matrix.astype(np.float32), radius)
