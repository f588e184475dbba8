"""Tells how a face stands in its scene: which way is up, and which way it looks.

Joints of eyes say it, or the version of a VRM; of others what their shapes move: an open jaw goes
down, and what goes furthest is at the front of a head.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from elocute.adoption.characters.vrm import Vrm
from elocute.array_types import Float64Array
from elocute.export.character_weights import UNREADABLE, CharacterMesh
from elocute.head.character import Character
from elocute.meshes.gltf_nodes import NodeTree

FURTHEST = 0.5
"""Share of the furthest move from which on what moves is the front of a jaw."""
AHEAD = 0.2
"""How far ahead of its head's middle a mouth is at least, in its breadths."""
HIGH, ASIDE = 4.0, 3.0
"""How far above the lowest that moves, and beside it, a head reaches, in the same."""
APART, TOGETHER = 0.2, 0.5
"""Shares of all moves that are left of their sum: below, no mouth opens; above, a jaw goes one way,
and not lips apart."""
DOWN, FLAT = 0.3, 0.7
"""A jaw goes down along Z where this little of it goes along Y, and so much along Z. Wide jaws go
back further than down."""
NEARLY_DEG = 15.0
"""A face this near to a quarter of a turn is meant to look there."""


@dataclass(frozen=True)
class Stance:
    """The angles of a Character of these names; told: whether anything says them."""

    facing_deg: float = 0.0
    tilt_deg: float = 0.0
    told: bool = True


def stance_of(
    character: Character, tree: NodeTree, joints: dict[str, int], vrm: Vrm | None
) -> Stance:
    """How the face of a character that stands along the scene's axes really stands.

    joints: nodes by the names of the built-in head's joints; vrm: what the file says as a VRM.
    """
    ahead = _of_eyes(tree, joints)
    if ahead is not None:
        return Stance(_angle_deg(ahead))
    if vrm is not None:
        return Stance(180.0 if vrm.version == 0 else 0.0)
    try:
        with np.errstate(all="ignore"):
            return _of_shapes(character)
    except UNREADABLE:  # then it is not drawn either, but may nod
        return Stance(told=not character.turns)


def _of_eyes(tree: NodeTree, joints: dict[str, int]) -> Float64Array | None:
    """(3,) ahead, to the left of which the left eye is."""
    if not {"eyeLeft", "eyeRight"} <= set(joints):
        return None
    with np.errstate(all="ignore"):
        left, right = (tree.world(joints[f"eye{side}"])[:3, 3] for side in ("Left", "Right"))
        mirror = np.sign(np.linalg.det(tree.world(joints["eyeLeft"])[:3, :3]))
        x, _, z = mirror * (left - right)
    seen = np.isfinite([x, z]).all() and np.hypot(x, z) > 1e-6
    return np.array([-z, 0.0, x]) if seen else None


def _angle_deg(ahead: Float64Array) -> float:
    angle = float(np.degrees(np.arctan2(ahead[0], ahead[2])))
    quarter = 90.0 * round(angle / 90)
    nearly = quarter if abs(angle - quarter) < NEARLY_DEG else angle
    return 180.0 - (180.0 - nearly) % 360.0  # 180 and not -180


def _of_shapes(character: Character) -> Stance:
    mesh = CharacterMesh(character)
    opening = mesh.opening(1)  # the others may push lips ahead
    reach = np.linalg.norm(opening, axis=1)
    for each in () if opening.any() else character.controls:
        reach += np.linalg.norm(mesh.moved(each), axis=1)
    if not 0 < reach.max(initial=0.0) < np.inf:
        return Stance(told=not character.turns)
    up = -opening.sum(axis=0) / reach.sum()
    if opening.any() and np.linalg.norm(up) < APART:
        return Stance(told=False)
    tilt = _tilt_deg(up)
    axes = replace(character, tilt_deg=tilt).axes
    mouth = mesh.points[reach >= FURTHEST * reach.max()] @ axes
    for points in (mesh.points, mesh.around):
        ahead = _ahead(mouth, points @ axes)
        if ahead is not None:
            return Stance(_angle_deg(ahead), tilt)
    return Stance(0.0, tilt, told=False)


def _tilt_deg(up: Float64Array) -> float:
    """Where up is, by the way back of an open jaw: 0 along Y, 90 along Z, -90 down Z."""
    share = float(np.linalg.norm(up))
    if share < TOGETHER or up[1] > DOWN * share or abs(up[2]) < FLAT * share:
        return 0.0
    return 90.0 if up[2] > 0 else -90.0


def _ahead(mouth: Float64Array, points: Float64Array) -> Float64Array | None:
    """(3,) from the middle of a head to its mouth; None where that is too near to say.

    mouth: (vertex, 3) what moves most; points: (vertex, 3) of the head and what is about it; y up.
    """
    wide = np.ptp(mouth[:, [0, 2]], axis=0).max()
    place, up = mouth.mean(axis=0), points[:, 1] - mouth[:, 1].min()
    near = (up >= 0) & (up < HIGH * wide)
    near &= (np.abs(points - place)[:, [0, 2]] < ASIDE * wide).all(axis=1)
    if not near.any():
        return None
    ahead = place - (points[near].min(axis=0) + points[near].max(axis=0)) / 2
    return ahead if np.hypot(ahead[0], ahead[2]) > AHEAD * wide else None
