"""VRM 1.0: an animated head as an avatar, with expressions, a gaze and humanoid bones.

The file is a .glb with ARKit's shapes whose expressions are mixes of these. Its animation is plain
glTF, which VRM programs leave alone: they play a .vrma (`vrm_animation`).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from elocute.errors import OutputError
from elocute.export.fitted_shapes import check_shapes
from elocute.export.gltf import animated_file
from elocute.export.gltf_character import character_glb
from elocute.export.options import GlbOptions
from elocute.export.vrm_body import add_body, bone_joints, eye_middle, standing
from elocute.files.atomic import write_atomically
from elocute.head.builtin import load_builtin_head
from elocute.head.character import Character
from elocute.head.feeling_shapes import both_sides
from elocute.head.gaze import gaze_reach
from elocute.head.model import HeadModel
from elocute.head.preset_shapes import VRM_FEELINGS, VRM_GAZE, VRM_LIDS, VRM_MOUTH
from elocute.motion.curves import ARKIT_NAMES
from elocute.motion.motion import Motion

EXTENSION = "VRMC_vrm"
LICENCE = "https://vrm.dev/licenses/1.0/"
CC0 = "https://creativecommons.org/publicdomain/zero/1.0/"


def write_vrm(
    motion: Motion, path: str | Path, *, sound: object = None, progress: Any = None
) -> None:
    """Write an animated head as a VRM 1.0; a character that is a VRM moves in its own file.

    Parameters
    ----------
    motion : Motion
        What to write.
    path : str or Path
        The file; one of that name is replaced.
    sound : object, optional
        Not written: a VRM has none.
    progress : callable, optional
        Not called: the file is written at once.

    Raises
    ------
    OutputError
        For a place that cannot be written, a head without ARKit's shapes, and a character that is
        no VRM.
    HeadError
        For a head with an image that is none.
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
    """An animated head as the bytes of a .vrm.

    Parameters
    ----------
    motion : Motion
        What to write.

    Returns
    -------
    bytes

    Raises
    ------
    OutputError
        For a head without ARKit's shapes.
    HeadError
        For a head with an image that is none.
    """
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
    told: dict[str, Any] = {"name": head.name, "licenseUrl": LICENCE}
    if head.notice:
        told["copyrightInformation"] = head.notice
    if head.notice != load_builtin_head().notice:
        return told | {"authors": ["unknown"]}
    return told | {
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
