"""Adds the humanoid bones that a VRM must have around a head that has none below its neck.

They are nodes without a mesh, in a T pose with feet on the ground: a body 1.70 m tall with segments
as Drillis and Contini (1966) give them. Neck, head and eyes are the head's own joints.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from elocute.array_types import Float64Array
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion

STATURE_M = 1.7
EYES = 0.936
"""Height of the eyes, in statures, as all below."""
_SIDE = {
    "UpperLeg": ("hips", (0.055, 0.52)),
    "LowerLeg": ("UpperLeg", (0.055, 0.285)),
    "Foot": ("LowerLeg", (0.055, 0.039)),
    "UpperArm": ("chest", (0.11, 0.818)),
    "LowerArm": ("UpperArm", (0.296, 0.818)),
    "Hand": ("LowerArm", (0.442, 0.818)),
}
BODY: dict[str, tuple[str, tuple[float, float]]] = {
    "hips": ("", (0.0, 0.53)),
    "spine": ("hips", (0.0, 0.585)),
    "chest": ("spine", (0.0, 0.68)),
} | {
    f"{side}{name}": (parent if parent in ("hips", "chest") else f"{side}{parent}", (way * x, y))
    for side, way in (("left", 1), ("right", -1))
    for name, (parent, (x, y)) in _SIDE.items()
}
"""By the name of a bone: its parent, and where it is, to its own left and up; parents first."""
CARRIES_HEAD = "chest"


def bone_joints(head: HeadModel) -> dict[str, int]:
    """Which joints of a head are humanoid bones.

    Parameters
    ----------
    head : HeadModel
        Any.

    Returns
    -------
    dict of str to int
        Joints by the names that VRM has for bones: head, where there is a joint at all, and neck,
        leftEye and rightEye, where the head has them.
    """
    names = head.joint_names
    if not names:
        return {}
    # A head that turns about one joint alone, as FLAME's, turns about its neck.
    top = next((name for name in ("head", "neck") if name in names), names[0])
    own = {"head": top, "neck": "neck", "leftEye": "eyeLeft", "rightEye": "eyeRight"}
    return {
        bone: names.index(name)
        for bone, name in own.items()
        if name in names and (bone == "head" or name != top)
    }


def eye_middle(head: HeadModel) -> Float64Array:
    """(3,) m: the place between the eyes of a head."""
    names, place = head.joint_names, head.joint_positions.astype(np.float64)
    eyes = [place[names.index(name)] for name in ("eyeLeft", "eyeRight") if name in names]
    if len(eyes) == 2:
        return (eyes[0] + eyes[1]) / 2
    # A face is about half a head's height below its top.
    low, high = head.template.min(axis=0), head.template.max(axis=0)
    return np.array([(low[0] + high[0]) / 2, high[1] - 0.11, high[2] - 0.03], np.float64)


def standing(motion: Motion) -> Motion:
    """The same motion of a head that stands on a body, its neck above the origin.

    Parameters
    ----------
    motion : Motion
        Any.

    Returns
    -------
    Motion
        Of a head whose vertices and joints are where the body carries them.
    """
    head = motion.head
    eyes = eye_middle(head)
    root = head.joint_positions[0].astype(np.float64) if head.joint_names else eyes
    shift = np.array([-root[0], EYES * STATURE_M - eyes[1], -root[2]])
    moved = replace(
        head,
        template=(head.template + shift).astype(np.float32),
        joint_positions=(head.joint_positions + shift).astype(np.float32),
    )
    return replace(motion, head=moved)


def add_body(
    head: HeadModel, nodes: list[dict[str, Any]], first: int
) -> tuple[int, dict[str, int]]:
    """Put a body below a standing head.

    Parameters
    ----------
    head : HeadModel
        As `standing` makes it.
    nodes : list of dict
        The nodes of a file; those of the body are added, and the head's root joints hang from it.
    first : int
        The node of the head's first joint; the others follow it.

    Returns
    -------
    root : int
        The node at the origin that carries all.
    bones : dict of str to int
        Nodes by the names that VRM has for bones.
    """
    bones = {bone: first + joint for bone, joint in bone_joints(head).items()}
    roots = [first + joint for joint, parent in enumerate(head.joint_parents) if parent < 0]
    if "head" not in bones:
        bones["head"] = len(nodes)
        roots = [len(nodes)]
        nodes.append({"name": "Head", "translation": eye_middle(head).tolist()})
    places = {bone: np.array([*place, 0.0]) * STATURE_M for bone, (_, place) in BODY.items()}
    for bone, (parent, _) in BODY.items():
        bones[bone] = len(nodes)
        offset = places[bone] - (places[parent] if parent else 0)
        nodes.append({"name": bone[0].upper() + bone[1:], "translation": offset.tolist()})
        if parent:
            nodes[bones[parent]].setdefault("children", []).append(bones[bone])
    nodes[bones[CARRIES_HEAD]].setdefault("children", []).extend(roots)
    for node in roots:
        nodes[node]["translation"] = (nodes[node]["translation"] - places[CARRIES_HEAD]).tolist()
    nodes.append({"name": "Root", "children": [bones["hips"]]})
    return len(nodes) - 1, bones
