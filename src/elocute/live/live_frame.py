"""One frame of a live face, as targets ask for it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from elocute.array_types import Float32Array, Float64Array
from elocute.export.arkit_csv import COLUMNS, arkit_curves, head_poses
from elocute.export.shape_profiles import FittedShapes, vrm_shapes
from elocute.head.builtin import load_builtin_head
from elocute.models.streaming import Frame
from elocute.motion.motion import Motion


@dataclass(frozen=True, eq=False)
class LiveFrame:
    """A frame of the built-in head, as `elocute.stream` gave it, and its number from 0."""

    number: int
    fps: float
    frame: Frame

    @cached_property
    def motion(self) -> Motion:
        """The frame as a motion of its own."""
        weights = self.frame.values[None].astype(np.float32)
        rotations = self.frame.rotations[None].astype(np.float32)
        head = load_builtin_head()
        turned = rotations if rotations.shape[1] == len(head.joint_names) else None
        return Motion(head, weights, self.fps, rotations=turned)

    @cached_property
    def arkit(self) -> dict[str, float]:
        """ARKit's 52 curves, 0 to 1, in the order of Live Link Face."""
        values = arkit_curves(self.motion).select(COLUMNS).values[0]
        return dict(zip(COLUMNS, values.tolist(), strict=True))

    @cached_property
    def vrm(self) -> dict[str, float]:
        """Weights of VRM 1.0's expressions, 0 to 1."""
        shapes = _vrm_shapes()
        weights = np.clip(shapes.weights(self.motion)[0], 0, 1)
        return dict(zip(shapes.names, weights.tolist(), strict=True))

    @cached_property
    def head_turns(self) -> Float64Array:
        """(3,) yaw, pitch and roll of neck and head together, half turns: to the own left, chin
        down, to the own right."""
        poses = head_poses(self.motion)
        return np.zeros(3) if poses is None else poses[0]

    def joint(self, name: str) -> Float32Array:
        """(4,) quaternion wxyz of a joint of the built-in head."""
        if self.motion.rotations is None:
            return np.array([1, 0, 0, 0], np.float32)
        return self.motion.rotations[0, self.motion.head.joint_names.index(name)]


@cache
def _vrm_shapes() -> FittedShapes:
    return vrm_shapes(load_builtin_head())
