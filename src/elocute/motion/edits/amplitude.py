"""Amplitude: how far parts of a face move, region by region."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from elocute.errors import MotionError
from elocute.motion.edits.closures import keep_contacts
from elocute.motion.motion import Motion, check_motion
from elocute.numerics.input_checks import check_kind, real_number
from elocute.numerics.quaternions import from_axis_angle, to_axis_angle
from elocute.one_line_repr import brief

AMPLITUDE_MAX = 3.0
SHAPES: dict[str, tuple[str, ...]] = {
    "jaw": ("jaw", "mouthClose"),
    "lips": ("mouth", "tongue"),
    "brows": ("brow",),
    "eyes": ("eyeLook", "eyeSquint", "eyeWide"),
    "cheeks": ("cheek", "nose"),
    "head": (),
}
"""Regions, and how the names of their shapes begin; mouthClose goes with the jaw."""
JOINTS: dict[str, tuple[str, ...]] = {"eyes": ("eyeLeft", "eyeRight"), "head": ("neck", "head")}


def with_amplitude(
    motion: Motion,
    regions: Mapping[str, float],
    *,
    share: NDArray[np.float64] | float = 1.0,
) -> Motion:
    """Let parts of the face move further or less.

    Parameters
    ----------
    motion : Motion
        On a head with shapes or joints of these regions.
    regions : mapping of str to float
        jaw, lips, brows, eyes, cheeks, head; 0 to 3, where 1 leaves the region as it is. Blinks
        are no part of the eyes' amplitude: lids shut, or they do not.
    share : (frame,) or float
        How much of it holds, 0 to 1.

    Returns
    -------
    Motion
        Lips that were sealed, and a lip at the teeth, are so still. No weight passes one that did
        not before.

    Raises
    ------
    MotionError
        For another region or number, and a head without any shape or joint there.
    """
    check_motion(motion)
    factors = _checked(motion, regions)
    weights, turns = motion.weights.copy(), motion.rotations
    for region, factor in factors.items():
        size = np.broadcast_to(1 + share * (factor - 1), motion.frame_count)[:, None]
        columns = _columns(motion, region)
        most = np.maximum(1, np.abs(weights[:, columns]))
        weights[:, columns] = np.clip(weights[:, columns] * size, -most, most)
        joints = _joints(motion, region)
        if turns is not None and joints:
            turns = turns.copy()
            vectors = to_axis_angle(turns[:, joints]) * size[:, :, None]
            turns[:, joints] = from_axis_angle(vectors)
    moved = replace(motion, weights=weights, rotations=turns)
    if not {"jaw", "lips"} & set(factors):
        return moved
    size = np.clip(1 + share * (factors.get("jaw", 1.0) - 1), 0, 1)
    return keep_contacts(motion, moved, size)


def _checked(motion: Motion, regions: Mapping[str, float]) -> dict[str, float]:
    check_kind("amplitude", regions, Mapping, "numbers by region", MotionError)
    factors = {}
    for region, given in regions.items():
        if region not in SHAPES:
            raise MotionError.about(
                "amplitude", found=f"region {brief(region)}", allowed=", ".join(SHAPES)
            )
        factor = real_number(given)
        if factor is None or not 0 <= factor <= AMPLITUDE_MAX:
            raise MotionError.about(
                f"amplitude of {region}", found=brief(given), allowed=f"0 to {AMPLITUDE_MAX:g}"
            )
        if not _columns(motion, region) and not _joints(motion, region):
            raise MotionError.about(
                f"amplitude of {region}",
                found=f"head {motion.head.name!r} has no shape of it",
                allowed="a head with ARKit's shapes",
            )
        factors[region] = factor
    return factors


def _columns(motion: Motion, region: str) -> list[int]:
    others = SHAPES["jaw"] if region == "lips" else ()
    return [
        place
        for place, name in enumerate(motion.names)
        if SHAPES[region] and name.startswith(SHAPES[region]) and not name.startswith(others)
    ]


def _joints(motion: Motion, region: str) -> list[int]:
    known = motion.head.joint_names
    return [known.index(name) for name in JOINTS.get(region, ()) if name in known]
