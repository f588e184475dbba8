"""VRM 1.0: an animated head as an avatar, with expressions, a gaze and humanoid bones.

The file is a .glb with ARKit's shapes whose expressions are mixes of these. Its animation is plain
glTF, which VRM programs leave alone: they play a .vrma (`vrm_animation`).

The bones below the neck, which a VRM must have, are nodes without a mesh, in a T pose with feet on
the ground: a body 1.70 m tall with segments as Drillis and Contini (1966) give them.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from elocute.array_types import Float64Array
from elocute.errors import OutputError
from elocute.export.gltf import animated_file
from elocute.export.gltf_character import character_glb
from elocute.export.options import GlbOptions
from elocute.export.shape_profiles import check_shapes
from elocute.files.atomic import write_atomically
from elocute.head.builtin import load_builtin_head
from elocute.head.character import Character
from elocute.head.feeling_shapes import both_sides
from elocute.head.gaze import gaze_reach
from elocute.head.model import HeadModel
from elocute.head.preset_shapes import VRM_FEELINGS, VRM_GAZE, VRM_LIDS, VRM_MOUTH
from elocute.motion.curves import ARKIT_NAMES
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
EXTENSION = "VRMC_vrm"
LICENCE = "https://vrm.dev/licenses/1.0/"
CC0 = "https://creativecommons.org/publicdomain/zero/1.0/"


def write_vrm(
    motion: Motion, path: str | Path, *, sound: object = None, progress: Any = None
) -> None:
    """Write an animated head as a VRM 1.0, which has no sound; it is written at once.

    A character that is a VRM moves in its own file. Raises OutputError for a place that cannot be
    written, a head without ARKit's shapes, and a character that is no VRM; HeadError for a head
    with an image that is none.
    """
    path = Path(path)
    character = motion.head.character
    if character is not None:
        _check_is_vrm(path, character)
    with write_atomically(path) as draft:
        draft.write_bytes(
            vrm_bytes(motion) if character is None else character_glb(motion, character)
        )


def _check_is_vrm(path: Path, character: Character) -> None:
    used = character.document.record.get("extensions")
    if not isinstance(used, dict) or not {EXTENSION, "VRM"} & set(used):
        raise OutputError.about(
            path,
            found=f"a character that is no VRM ({character.name})",
            allowed="a VRM",
            remedy="write a .glb",
        )


def vrm_bytes(motion: Motion) -> bytes:
    """An animated head as the bytes of a .vrm. Raises as `write_vrm`."""
    check_shapes(motion.head, "a VRM", set(ARKIT_NAMES))
    motion = standing(motion.dressed())
    head = motion.head
    file = animated_file(motion, GlbOptions(profile="arkit"))
    nodes = file.json["nodes"]
    root, bones = add_body(head, nodes, first=1)
    file.json["scenes"] = [{"nodes": [0, root]}]
    file.uses(EXTENSION)
    file.json["extensions"] = {
        EXTENSION: {
            "specVersion": "1.0",
            "meta": _meta(head),
            "humanoid": {"humanBones": {bone: {"node": node} for bone, node in bones.items()}},
            "firstPerson": {"meshAnnotations": [{"node": 0, "type": "thirdPersonOnly"}]},
            "lookAt": _look_at(head),
            "expressions": _expressions(head, file.json["meshes"][0]["extras"]["targetNames"]),
        }
    }
    return file.pack()


def _meta(head: HeadModel) -> dict[str, Any]:
    """Whose it is, and what is allowed; of a head that is not ours only what is always allowed."""
    meta: dict[str, Any] = {"name": head.name, "licenseUrl": LICENCE}
    if head.notice:
        meta["copyrightInformation"] = head.notice
    if head.notice != load_builtin_head().notice:
        return meta | {"authors": ["unknown"]}
    return meta | {
        "authors": ["Elocute", "MakeHuman Community"],
        "avatarPermission": "everyone",
        "commercialUsage": "corporation",
        "allowPoliticalOrReligiousUsage": True,
        "creditNotation": "unnecessary",
        "allowRedistribution": True,
        "modification": "allowModificationRedistribution",
        "otherLicenseUrl": CC0,
    }


def _look_at(head: HeadModel) -> dict[str, Any]:
    """Gaze by expressions, which take the lids along."""
    joints = bone_joints(head)
    start = head.joint_positions[joints["head"]] if joints else eye_middle(head)
    ranges = {
        name: {"inputMaxValue": round(degrees, 2), "outputScale": 1.0}
        for name, degrees in zip(
            ("VerticalUp", "VerticalDown", "HorizontalInner", "HorizontalOuter"),
            gaze_reach(head).values(),
            strict=True,
        )
    }
    return {
        "type": "expression",
        "offsetFromHeadBone": (eye_middle(head) - start).tolist(),
        **{f"rangeMap{name}": each for name, each in ranges.items()},
    }


def _expressions(head: HeadModel, targets: list[str]) -> dict[str, Any]:
    """VRM's own as mixes of ARKit's shapes, and each of these by its name."""
    feelings = {
        name: both_sides(looks, head.expression_names) for name, looks in VRM_FEELINGS.items()
    }
    presets = VRM_MOUTH | VRM_LIDS | VRM_GAZE | feelings
    return {
        "preset": {name: _expression(looks, targets) for name, looks in presets.items()},
        "custom": {name: _expression({name: 1.0}, targets) for name in ARKIT_NAMES},
    }


def _expression(looks: dict[str, float], targets: list[str]) -> dict[str, Any]:
    binds = [
        {"node": 0, "index": targets.index(name), "weight": weight}
        for name, weight in looks.items()
    ]
    return {"isBinary": False, "morphTargetBinds": binds}


def bone_joints(head: HeadModel) -> dict[str, int]:
    """Which joints of a head are humanoid bones, by the names that VRM has for these: head, where
    there is a joint at all, and neck, leftEye and rightEye, where the head has them."""
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
    """The same motion of a head that stands on a body, its neck above the origin."""
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
    """Put a body below a head that `standing` made.

    Its nodes are added to those of the file, of which `first` is the head's first joint and the
    others follow it; the head's root joints hang from the body. Returns the node at the origin that
    carries all, and nodes by the names that VRM has for bones.
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
