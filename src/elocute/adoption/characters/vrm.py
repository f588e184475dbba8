"""Reads what a VRM, version 0 or 1, says of its face: expressions, joints, how its eyes turn."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, TypeGuard

from elocute.files.json_records import finite_number
from elocute.meshes.gltf_document import GltfDocument, morph_targets

VRM_BONES = {
    "neck": "neck",
    "head": "head",
    "jaw": "jaw",
    "leftEye": "eyeLeft",
    "rightEye": "eyeRight",
}
"""What a VRM calls the joints of the built-in head."""
OVERRIDDEN = ("blink", "lookAt", "mouth")
"""What an expression of a VRM 1.0 may take away of others."""
RANGES = {
    "In": ("rangeMapHorizontalInner", "lookAtHorizontalInner"),
    "Out": ("rangeMapHorizontalOuter", "lookAtHorizontalOuter"),
    "Down": ("rangeMapVerticalDown", "lookAtVerticalDown"),
    "Up": ("rangeMapVerticalUp", "lookAtVerticalUp"),
}


@dataclass(frozen=True)
class Expression:
    """An expression of a VRM."""

    name: str  # as the file has it
    preset: bool  # whether the name is one of the specification's
    # mesh, morph target and its weight where the expression is at one
    binds: tuple[tuple[int, int, float], ...]
    switch: bool  # whether it is only ever off or on
    # "block" or "blend" by what it takes away: "blink", "lookAt", "mouth"
    overrides: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Vrm:
    """What a VRM says of its face."""

    version: int  # 0 or 1
    expressions: tuple[Expression, ...] = ()  # those that move morph targets
    # nodes by the names of the built-in head's joints
    joints: dict[str, int] = field(default_factory=dict)
    eyes_by_joints: bool = False  # whether its eyes look by their joints
    # degrees that an eye turns for a degree of gaze, by direction
    gaze: dict[str, float] = field(default_factory=dict)


def read_vrm(document: GltfDocument) -> Vrm | None:
    """What a file says as a VRM; None for one that is no VRM. What points at nothing is left
    out."""
    extensions = _record(document.record.get("extensions"))
    if "VRMC_vrm" in extensions:
        return _version_1(document, _record(extensions["VRMC_vrm"]))
    if "VRM" in extensions:
        return _version_0(document, _record(extensions["VRM"]))
    return None


def _version_1(document: GltfDocument, vrm: dict[str, Any]) -> Vrm:
    nodes = document.records("nodes")
    expressions = []
    for kind in ("preset", "custom"):
        for name, given in _record(_record(vrm.get("expressions")).get(kind)).items():
            expression, binds = _record(given), []
            for bind in _records(expression.get("morphTargetBinds")):
                node = bind.get("node")
                if _is_index(node, len(nodes)) and "mesh" in nodes[node]:
                    binds.append((nodes[node]["mesh"], bind.get("index"), bind.get("weight"), 1.0))
            switch = expression.get("isBinary") is True
            overrides = {
                what: str(expression.get(f"override{what[0].upper()}{what[1:]}"))
                for what in OVERRIDDEN
                if expression.get(f"override{what[0].upper()}{what[1:]}") in ("block", "blend")
            }
            expressions.append((str(name)[:200], kind == "preset", binds, switch, overrides))
    bones = _record(_record(vrm.get("humanoid")).get("humanBones"))
    joints = {name: _record(bone).get("node") for name, bone in bones.items()}
    look = _record(vrm.get("lookAt"))
    gaze = {
        way: _ratio(_record(look.get(new)), "outputScale", "inputMaxValue")
        for way, (new, _) in RANGES.items()
    }
    return _vrm(document, 1, expressions, joints, look.get("type") == "bone", gaze)


def _version_0(document: GltfDocument, vrm: dict[str, Any]) -> Vrm:
    expressions = []
    for group in _records(_record(vrm.get("blendShapeMaster")).get("blendShapeGroups")):
        preset = group.get("presetName")
        known = isinstance(preset, str) and preset.lower() not in ("", "unknown")
        name = preset if known else group.get("name")
        binds = [
            (bind.get("mesh"), bind.get("index"), bind.get("weight"), 0.01)  # in hundredths
            for bind in _records(group.get("binds"))
        ]
        expressions.append((str(name)[:200], known, binds, group.get("isBinary") is True, {}))
    bones = _records(_record(vrm.get("humanoid")).get("humanBones"))
    joints = {str(bone.get("bone")): bone.get("node") for bone in bones}
    look = _record(vrm.get("firstPerson"))
    gaze = {
        way: _ratio(_record(look.get(old)), "yRange", "xRange") for way, (_, old) in RANGES.items()
    }
    return _vrm(document, 0, expressions, joints, look.get("lookAtTypeName") == "Bone", gaze)


def _vrm(
    document: GltfDocument,
    version: int,
    found: list[tuple[str, bool, list[Any], bool, dict[str, str]]],
    joints: dict[str, Any],
    by_joints: bool,
    gaze: dict[str, float],
) -> Vrm:
    meshes, count = document.records("meshes"), len(document.records("nodes"))
    expressions = []
    for name, preset, weights, switch, overrides in found:
        binds = []
        for mesh, target, weight, scale in weights:
            share = finite_number(weight)
            if share is None or not _is_index(mesh, len(meshes)) or not 0 < share * scale <= 1:
                continue
            if _is_index(target, len(morph_targets(meshes[mesh]))):
                binds.append((mesh, target, share * scale))
        if binds:
            expressions.append(Expression(name, preset, tuple(binds), switch, overrides))
    known = {
        VRM_BONES[name]: node
        for name, node in joints.items()
        if name in VRM_BONES and _is_index(node, count)
    }
    return Vrm(version, tuple(expressions), known, by_joints, gaze)


def _ratio(angles: dict[str, Any], output: str, input: str) -> float:
    """Degrees out for a degree in; one where nothing sensible is said."""
    top, bottom = finite_number(angles.get(output)), finite_number(angles.get(input))
    if top is None or bottom is None or bottom <= 0 or not 0 <= top / bottom <= 1:
        return 1.0
    return top / bottom


def _is_index(value: Any, count: int) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < count


def _record(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _records(value: Any) -> list[dict[str, Any]]:
    return [each for each in value if isinstance(each, dict)] if isinstance(value, list) else []
