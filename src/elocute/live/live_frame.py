"""One frame of a live face, as targets ask for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from elocute.array_types import Float32Array, Float64Array
from elocute.export.arkit_csv import COLUMNS, arkit_curves, head_poses
from elocute.export.shape_profiles import FittedShapes, vrm_shapes
from elocute.head.builtin import load_builtin_head
from elocute.models.streaming import Frame
from elocute.motion.motion import Motion
from elocute.numerics.quaternions import blend


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


@dataclass(frozen=True)
class Shapes:
    """Curves of a kind: their names in order, and their values of a frame by name."""

    names: Callable[[], tuple[str, ...]]
    values: Callable[[LiveFrame], dict[str, float]]


def vrm_names() -> tuple[str, ...]:
    """The names of VRM 1.0's expressions, in the order of `LiveFrame.vrm`."""
    return _vrm_shapes().names


SHAPES = {
    "arkit": Shapes(lambda: COLUMNS, lambda frame: frame.arkit),
    "vrm": Shapes(vrm_names, lambda frame: frame.vrm),
    "elocute": Shapes(
        lambda: load_builtin_head().expression_names,
        lambda frame: dict(zip(frame.frame.names, frame.frame.values.tolist(), strict=True)),
    ),
}
"""Whose names curves can have: ARKit's, the expressions of VRM 1.0, or all of the built-in head."""


def faded(old: LiveFrame, new: LiveFrame, share: float) -> LiveFrame:
    """What lies between two frames, at the time of the new one; share 0 is the old."""
    values = old.frame.values + share * (new.frame.values - old.frame.values)
    turned = blend(old.frame.rotations, new.frame.rotations, np.array(share))
    turns = turned.astype(np.float32)
    return replace(new, frame=replace(new.frame, values=values, rotations=turns))


@cache
def _vrm_shapes() -> FittedShapes:
    return vrm_shapes(load_builtin_head())
