"""Which shapes a file carries: all that move the head, or ARKit's alone, and visemes on request.

Programs that drive avatars look for ARKit's 52 names. The head's own speech shapes are then folded
into the nearest of these. Others look for visemes or VRM's expressions, with which the mouth is
fitted (`fitted_shapes`). What that leaves is measured, never hidden.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from elocute.array_types import Float32Array
from elocute.export.fitted_shapes import farthest_mm, mixed_shapes, oculus_shapes, vrm_shapes
from elocute.head.model import HeadModel
from elocute.head.preset_shapes import OCULUS_SHAPES
from elocute.motion.curves import ARKIT_NAMES
from elocute.motion.motion import Motion

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


class Targets(Protocol):
    """Morph targets of a file, whichever profile made them.

    Attributes
    ----------
    names : tuple of str
        One per target.
    basis : (target, vertex, 3) float32
        Metres at weight one.
    """

    @property
    def names(self) -> tuple[str, ...]: ...

    @property
    def basis(self) -> Float32Array: ...

    def weights(self, motion: Motion) -> Float32Array:
        """(frame, target) weights over a motion of the head."""
        ...

    def shown(self, motion: Motion) -> Float32Array:
        """(frame, component) the weights of the head's shapes that they show."""
        ...

    def report(self, motion: Motion) -> dict[str, Any]:
        """What the targets cannot show of it; {} where they show all."""
        ...


@dataclass(frozen=True, eq=False)
class TargetShapes:
    """Morph targets that stand for the shapes of a head.

    Parameters
    ----------
    names : tuple of str
        One per target.
    basis : (target, vertex, 3) float32
        Metres at weight one.
    mix : (component, target) float32
        What each of the head's shapes gives to each target.
    folded : dict of str
        By the name of a shape that is no target: the targets that stand for it.
    """

    names: tuple[str, ...]
    basis: Float32Array
    mix: Float32Array
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
        told: dict[str, Any] = {}
        for name, parts in self.folded.items():
            shape = head.expression_basis[head.expression_index(name)]
            stand_in = np.zeros_like(shape)
            for part, share in parts.items():
                stand_in += np.float32(share) * self.basis[self.names.index(part)]
            apart = np.linalg.norm(shape - stand_in, axis=1)
            moved = np.linalg.norm(shape, axis=1) > 0
            mean = float(apart[moved].mean()) if moved.any() else 0.0
            told[name] = {
                "into": parts,
                "left_mm": {"max": _mm(apart.max(initial=0)), "mean": _mm(mean)},
            }
        left_mm = farthest_mm(motion, self.shown(motion)).max(initial=0)
        return {"shapes": told, "take_mm": round(float(left_mm), 3)}

    def shown(self, motion: Motion) -> Float32Array:
        """(frame, component) the weights of the head's shapes that the targets are."""
        found, weights = np.zeros_like(motion.weights), self.weights(motion)
        own = [place for place, name in enumerate(self.names) if name in motion.names]
        found[:, [motion.names.index(self.names[place]) for place in own]] = weights[:, own]
        return found


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
