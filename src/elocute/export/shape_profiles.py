"""Which shapes a file carries: all that move the head, or ARKit's alone, and visemes on request.

Programs that drive avatars look for ARKit's 52 names. The head's own speech shapes are then folded
into the nearest of these. Others look for visemes or VRM's expressions, with which the mouth is
fitted frame by frame, as it is for characters that have nothing else; lids and gaze are taken over.
What that leaves is measured, never hidden.
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
from elocute.motion.curves import ARKIT_NAMES, Curves
from elocute.motion.motion import Motion

STANDARDS = ("arkit", "oculus", "vrm")
BLOCK = 60  # frames at a time whose vertices are compared
LEFT_OUT = 0.01
"""A curve that reaches more and has no target is told."""


@dataclass(frozen=True, eq=False)
class FittedShapes:
    """Targets that stand for the shapes of a head, though none of them is one."""

    names: tuple[str, ...]  # one per target
    basis: Float32Array  # (target, vertex, 3) metres at weight one
    # (target, component) what each does at weight one, as weights of the head's shapes
    looks: Float32Array
    fitted: tuple[str, ...]  # those that the mouth is fitted with
    # those whose weight is the mean of some of the head's shapes. All others rest, but for
    # `silent`.
    shared: dict[str, tuple[str, ...]]
    silent: str = ""  # the one that has what the fitted ones leave to one; "" for none
    _known: dict[int, tuple[Motion, ControlFit]] = field(default_factory=dict, repr=False)

    def weights(self, motion: Motion) -> Float32Array:
        """(frame, target) weights, 0 to 1, but where a curve that is taken over is beyond."""
        values = np.zeros((motion.frame_count, len(self.names)), np.float32)
        columns = [self.names.index(name) for name in self.fitted]
        values[:, columns] = self._fit(motion).weights
        for name, curves in self.shared.items():
            own = [motion.names.index(each) for each in curves]
            values[:, self.names.index(name)] = motion.weights[:, own].mean(axis=1)
        if self.silent:
            rest = 1 - np.take(values, columns, axis=1).sum(axis=1)
            values[:, self.names.index(self.silent)] = np.maximum(rest, 0)
        return values

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
    squared = np.zeros(len(off))
    for start in range(0, len(off), BLOCK):
        apart = np.tensordot(off[start : start + BLOCK, used], basis, 1)
        squared[start : start + BLOCK] = (apart**2).sum(axis=2).max(axis=1, initial=0)
    return 1000 * np.sqrt(squared)


def oculus_shapes(head: HeadModel) -> FittedShapes:
    """The fifteen visemes, and after them the head's shapes that are not of the mouth.

    Raises OutputError for a head without ARKit's shapes.
    """
    others = [name for name in head.expression_names if not is_of_mouth(name)]
    looks = OCULUS_SHAPES | {name: {name: 1.0} for name in others}
    return _fitted_shapes(
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
    return _fitted_shapes(
        head,
        "vrm",
        VRM_MOUTH | VRM_LIDS | VRM_GAZE | feelings,
        fitted=tuple(VRM_MOUTH),
        shared=moved,
    )


def _fitted_shapes(
    head: HeadModel, profile: str, looks: dict[str, dict[str, float]], **which: Any
) -> FittedShapes:
    mixes, basis = mixed_shapes(head, f"profile {profile}", looks.values())
    return FittedShapes(tuple(looks), basis, mixes, **which)


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


# Speech shapes that ARKit lacks, as its nearest shapes.
NEAREST: dict[str, dict[str, float]] = {
    "mouthLabiodental": {
        "mouthRollLower": 0.55,
        "mouthUpperUpLeft": 0.25,
        "mouthUpperUpRight": 0.25,
    },
    "tongueDental": {"tongueOut": 0.25},
    "tongueTipUp": {},
}


@dataclass(frozen=True, eq=False)
class TargetShapes:
    """Morph targets that stand for the shapes of a head."""

    names: tuple[str, ...]  # one per target
    basis: Float32Array  # (target, vertex, 3) metres at weight one
    # (component, target) what each of the head's shapes gives to each target
    mix: Float32Array
    # by the name of a shape that is no target: the targets that stand for it
    folded: dict[str, dict[str, float]]

    def weights(self, motion: Motion) -> Float32Array:
        """(frame, target) weights; what is folded in takes none beyond one, or what it had."""
        mixed = motion.weights @ self.mix
        for name in {part for parts in self.folded.values() for part in parts}:
            column, own = self.names.index(name), motion.names.index(name)
            limit = np.maximum(motion.weights[:, own], 1)
            mixed[:, column] = np.minimum(mixed[:, column], limit)
        return mixed.astype(np.float32)

    def report(self, motion: Motion) -> dict[str, Any]:
        """What folding leaves.

        By the name of a folded shape: the targets that stand for it, and how far the skin is from
        the shape at weight one, largest and mean over what it moves, mm; `take_mm`: the farthest
        that a vertex of any frame is from where the motion has it.
        """
        if not self.folded:
            return {}
        head = motion.head
        shapes: dict[str, Any] = {}
        for name, parts in self.folded.items():
            shape = head.expression_basis[head.expression_index(name)]
            stand_in = np.zeros_like(shape)
            for part, share in parts.items():
                stand_in += np.float32(share) * self.basis[self.names.index(part)]
            apart = np.linalg.norm(shape - stand_in, axis=1)
            moved = np.linalg.norm(shape, axis=1) > 0
            mean = float(apart[moved].mean()) if moved.any() else 0.0
            shapes[name] = {
                "into": parts,
                "left_mm": {"max": _mm(apart.max(initial=0)), "mean": _mm(mean)},
            }
        left_mm = farthest_mm(motion, self.shown(motion)).max(initial=0)
        return {"shapes": shapes, "take_mm": round(float(left_mm), 3)}

    def shown(self, motion: Motion) -> Float32Array:
        """(frame, component) the weights of the head's shapes that the targets are."""
        equivalent, weights = np.zeros_like(motion.weights), self.weights(motion)
        own = [place for place, name in enumerate(self.names) if name in motion.names]
        equivalent[:, [motion.names.index(self.names[place]) for place in own]] = weights[:, own]
        return equivalent


Targets = TargetShapes | FittedShapes
"""Morph targets of a file, whichever profile made them."""


def target_shapes(head: HeadModel, profile: str, visemes: bool = False) -> Targets:
    """The targets of a head in a profile.

    profile: "arkit" folds speech shapes (those of `NEAREST`) into ARKit's, "elocute" keeps all;
    "oculus" and "vrm" fit the mouth with visemes or VRM's vowels. visemes: whether the fifteen
    visemes follow as targets that rest. Raises OutputError for a head that lacks the shapes that
    make visemes, or the profile's own.
    """
    if profile in FITTED:
        return FITTED[profile](head)
    return _own_shapes(head, profile, visemes)


FITTED = {"oculus": oculus_shapes, "vrm": vrm_shapes}


def _own_shapes(head: HeadModel, profile: str, visemes: bool) -> TargetShapes:
    names, basis = head.expression_names, head.expression_basis
    folded = _folded(names) if profile == "arkit" else {}
    kept = [index for index, name in enumerate(names) if name not in folded]
    mix = np.zeros((len(names), len(kept)), np.float32)
    mix[kept, np.arange(len(kept))] = 1
    kept_names = tuple(names[index] for index in kept)
    for name, parts in folded.items():
        for part, share in parts.items():
            mix[names.index(name), kept_names.index(part)] = share
    if not visemes:
        return TargetShapes(kept_names, basis[kept], mix, folded)
    more = mixed_shapes(head, "`visemes`", OCULUS_SHAPES.values())[1]
    return TargetShapes(
        kept_names + tuple(OCULUS_SHAPES),
        np.concatenate([basis[kept], more]),
        np.pad(mix, ((0, 0), (0, len(more)))),
        folded,
    )


def _folded(names: tuple[str, ...]) -> dict[str, dict[str, float]]:
    """Speech shapes whose nearest shapes are there, where ARKit's are at all."""
    if not set(names) & set(ARKIT_NAMES):
        return {}
    return {
        name: parts for name, parts in NEAREST.items() if name in names and set(parts) <= set(names)
    }


def _mm(length_m: float) -> float:
    return round(float(length_m) * 1000, 3)


@dataclass(frozen=True, eq=False)
class Conversion:
    """Curves of another standard.

    Attributes
    ----------
    curves : Curves
        (frame, target), 0 to 1 but where a curve that is taken over is beyond.
    residual_mm : (frame,) float64
        The farthest that a vertex of the face's skin is from where the motion has it. What the
        tongue does is not in it: no standard has all of that.
    report : dict
        What the targets cannot show, as the profiles of a .glb tell it.
    """

    curves: Curves
    residual_mm: Float64Array
    report: dict[str, Any]


def convert_curves(motion: Motion, standard: str) -> Conversion:
    """The curves of a standard that show a motion best.

    Parameters
    ----------
    motion : Motion
        Of a head with the built-in head's shapes.
    standard : str
        "arkit": its 52 shapes, the speech shapes folded in. "oculus": fifteen visemes and what is
        not of the mouth. "vrm": the expressions of VRM 1.0. Visemes and vowels are fitted to the
        mouth, from 0 to 1, few at a time, and lips that meet weigh most.

    Returns
    -------
    Conversion

    Raises
    ------
    OutputError
        For another standard, and a head without the shapes.
    """
    if standard not in STANDARDS:
        raise OutputError.about("standard", found=repr(standard), allowed=", ".join(STANDARDS))
    targets = target_shapes(motion.head, standard)
    curves = Curves(targets.weights(motion), targets.names, motion.fps)
    face = motion.head.regions.get("face", slice(None))
    left = farthest_mm(motion, targets.shown(motion), face)
    return Conversion(curves, left, targets.report(motion))
