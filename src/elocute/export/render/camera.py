"""Where the camera stands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float32Array
from elocute.errors import InputError
from elocute.export.render.backends_and_views import VIEWS
from elocute.head.model import HeadModel
from elocute.one_line_repr import brief

FIELD_DEG = 18.0  # vertical field of view: a portrait lens
MARGIN = 1.06


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


def portrait(head: HeadModel, view: str = "front") -> Camera:
    """A camera that frames a head with some of its neck, or the mouth alone.

    Parameters
    ----------
    head : HeadModel
        What is framed.
    view : str
        A key of `VIEWS`: "front", "three-quarter", "side" or "mouth".

    Returns
    -------
    Camera

    Raises
    ------
    InputError
        For an unknown view.
    """
    if not isinstance(view, str) or view not in VIEWS:
        raise InputError.about(f"view {brief(view)}", found="unknown", allowed=", ".join(VIEWS))
    yaw_deg, pitch_deg, share = VIEWS[view]
    low, high = head.template.min(axis=0), head.template.max(axis=0)
    # The bust below the chin fills the frame's foot; the crown keeps some air.
    top = high[1] + 0.02
    chin = head.template[head.landmarks[8], 1] if len(head.landmarks) else low[1]
    bottom = max(low[1] + 0.015, chin - 0.075)
    target = np.array([0.0, (top + bottom) / 2, high[2] - 0.1])
    if view == "mouth" and len(head.lip_rings):
        target = head.template[head.lip_rings[0]].mean(axis=0)
    height = (top - bottom) * share * MARGIN
    distance = height / 2 / np.tan(np.radians(FIELD_DEG) / 2)
    yaw, pitch = np.radians(yaw_deg), np.radians(pitch_deg)
    away = np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])
    return Camera((target + away * distance).astype(np.float32), target.astype(np.float32))
