"""Fits shapes of a standard that the head does not have: visemes, or VRM's expressions.

The mouth is fitted with them frame by frame, as it is for characters that have nothing else; lids
and gaze are taken over. What none of them can show is left out, and told.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array, Float64Array
from elocute.errors import OutputError
from elocute.head.feeling_shapes import both_sides
from elocute.head.model import HeadModel
from elocute.head.preset_shapes import (
    OCULUS_SHAPES,
    SILENT,
    VRM_FEELINGS,
    VRM_GAZE,
    VRM_LIDS,
    VRM_MOUTH,
)
from elocute.motion.control_fit import ControlFit, fit_controls, is_of_mouth
from elocute.motion.motion import Motion

BLOCK = 60  # frames at a time whose vertices are compared
LEFT_OUT = 0.01
"""A curve that reaches more and has no target is told."""


@dataclass(frozen=True, eq=False)
class FittedShapes:
    """Targets that stand for the shapes of a head, though none of them is one.

    Parameters
    ----------
    names : tuple of str
        One per target.
    basis : (target, vertex, 3) float32
        Metres at weight one.
    looks : (target, component) float32
        What each does at weight one, as weights of the head's shapes.
    fitted : tuple of str
        Those that the mouth is fitted with.
    shared : dict of str to tuple of str
        Those whose weight is the mean of some of the head's shapes. All others rest, but for
        `silent`.
    silent : str
        The one that has what the fitted ones leave to one; "" for none.
    """

    names: tuple[str, ...]
    basis: Float32Array
    looks: Float32Array
    fitted: tuple[str, ...]
    shared: dict[str, tuple[str, ...]]
    silent: str = ""
    _known: dict[int, tuple[Motion, ControlFit]] = field(default_factory=dict, repr=False)

    def weights(self, motion: Motion) -> Float32Array:
        """(frame, target) weights, 0 to 1, but where a curve that is taken over is beyond."""
        found = np.zeros((motion.frame_count, len(self.names)), np.float32)
        columns = [self.names.index(name) for name in self.fitted]
        found[:, columns] = self._fit(motion).weights
        for name, curves in self.shared.items():
            own = [motion.names.index(each) for each in curves]
            found[:, self.names.index(name)] = motion.weights[:, own].mean(axis=1)
        if self.silent:
            rest = 1 - np.take(found, columns, axis=1).sum(axis=1)
            found[:, self.names.index(self.silent)] = np.maximum(rest, 0)
        return found

    def shown(self, motion: Motion) -> Float32Array:
        """(frame, component) the weights of the head's shapes that the targets look like."""
        return self.weights(motion) @ self.looks

    def report(self, motion: Motion) -> dict[str, Any]:
        """What the fit leaves.

        `mouth`: the targets that it is fitted with; `residual_mm`: how far the skin around it is
        off (root mean square), the opening of the lips (mean), and the widest opening where lips
        touch; `left_out`: curves that move and that no target has; `take_mm`: the farthest that a
        vertex of any frame is from where the motion has it.
        """
        fit = self._fit(motion)
        carried = {name for curves in self.shared.values() for name in curves}
        peaks = np.abs(motion.weights).max(axis=0, initial=0)
        return {
            "mouth": list(self.fitted),
            "residual_mm": fit.residual(),
            "left_out": [
                name
                for name, peak in zip(motion.names, peaks, strict=True)
                if peak > LEFT_OUT and not is_of_mouth(name) and name not in carried
            ],
            "take_mm": round(float(farthest_mm(motion, self.shown(motion)).max(initial=0)), 3),
        }

    def _fit(self, motion: Motion) -> ControlFit:
        """The fit of the last motion is kept: a file asks for its weights and for its report."""
        if id(motion) not in self._known:
            looks = [
                dict(zip(motion.names, self.looks[self.names.index(name)].tolist(), strict=True))
                for name in self.fitted
            ]
            self._known.clear()
            self._known[id(motion)] = (motion, fit_controls(motion, looks))
        return self._known[id(motion)][1]


def farthest_mm(
    motion: Motion, shown: Float32Array, vertices: NDArray[np.integer] | slice = slice(None)
) -> Float64Array:
    """(frame,) the farthest that a vertex is from where the motion has it, where weights `shown`
    (frame, component) of the head's shapes are seen in its place."""
    off = shown - motion.weights
    used = np.flatnonzero(np.abs(off).max(axis=0, initial=0) > 0)
    basis = motion.head.expression_basis[used][:, vertices]
    found = np.zeros(len(off))
    for start in range(0, len(off), BLOCK):
        apart = np.tensordot(off[start : start + BLOCK, used], basis, 1)
        found[start : start + BLOCK] = (apart**2).sum(axis=2).max(axis=1, initial=0)
    return 1000 * np.sqrt(found)


def oculus_shapes(head: HeadModel) -> FittedShapes:
    """The fifteen visemes, and after them the head's shapes that are not of the mouth.

    Raises OutputError for a head without ARKit's shapes.
    """
    others = [name for name in head.expression_names if not is_of_mouth(name)]
    looks = OCULUS_SHAPES | {name: {name: 1.0} for name in others}
    return _shapes(
        head,
        "oculus",
        looks,
        fitted=tuple(name for name in OCULUS_SHAPES if name != SILENT),
        shared={name: (name,) for name in others},
        silent=SILENT,
    )


def vrm_shapes(head: HeadModel) -> FittedShapes:
    """The expressions of VRM 1.0: vowels, lids and gaze, which move, and feelings, which rest.

    Raises OutputError for a head without ARKit's shapes.
    """
    feelings = {
        name: both_sides(looks, head.expression_names) for name, looks in VRM_FEELINGS.items()
    }
    moved = {name: tuple(looks) for name, looks in (VRM_LIDS | VRM_GAZE).items()}
    del moved["blink"]  # each lid has its own
    return _shapes(
        head,
        "vrm",
        VRM_MOUTH | VRM_LIDS | VRM_GAZE | feelings,
        fitted=tuple(VRM_MOUTH),
        shared=moved,
    )


def _shapes(
    head: HeadModel,
    profile: str,
    looks: dict[str, dict[str, float]],
    *,
    fitted: tuple[str, ...],
    shared: dict[str, tuple[str, ...]],
    silent: str = "",
) -> FittedShapes:
    mixes, basis = mixed_shapes(head, f"profile {profile}", looks.values())
    return FittedShapes(tuple(looks), basis, mixes, fitted, shared, silent)


def mixed_shapes(
    head: HeadModel, about: str, looks: Collection[dict[str, float]]
) -> tuple[Float32Array, Float32Array]:
    """(look, component) weights and (look, vertex, 3) m of looks. Raises as `check_shapes`."""
    check_shapes(head, about, {name for look in looks for name in look})
    mixes = np.stack([head.expression_vector(look) for look in looks]).astype(np.float32)
    return mixes, np.tensordot(mixes, head.expression_basis, 1).astype(np.float32)


def check_shapes(head: HeadModel, about: str, needed: set[str]) -> None:
    """Raise OutputError for a head that lacks shapes that others are made of."""
    missing = sorted(needed - set(head.expression_names))
    if missing:
        raise OutputError.about(
            about,
            found=f"a head without {', '.join(missing[:5])}",
            allowed="a head with ARKit's shapes and the speech shapes, such as the built-in one",
        )
