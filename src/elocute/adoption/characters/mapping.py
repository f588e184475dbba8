"""Maps the built-in head's curves to a file's morph targets and joints.

A file that has all of ARKit's shapes that speech uses takes the curves as they are. Of any other
mouth (visemes, a VRM's vowels, a jaw alone) the weights are fitted to the built-in head's mouth,
frame by frame, where the motion is written.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from elocute.adoption.characters.given_names import GIVEN, GivenNames, meanings_with
from elocute.adoption.characters.morphs import HeadPart, MorphMesh
from elocute.adoption.characters.shape_names import (
    Meaning,
    like_a_mouth,
    meanings_of,
    nearest_name,
    vrm_meaning,
)
from elocute.adoption.characters.vrm import Vrm
from elocute.articulation.phone_targets import curve_names
from elocute.export.shape_profiles import NEAREST
from elocute.head.character import Control, Turn
from elocute.life.face import REACH_DEG
from elocute.meshes.gltf_nodes import NodeTree
from elocute.motion.control_fit import is_of_mouth
from elocute.motion.curves import ARKIT_NAMES

_JOINT_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
_JOINT_SIDES = {"l": "Left", "left": "Left", "r": "Right", "right": "Right"}
# Words that rigs put around the name of a joint: mixamorig:Head, CC_Base_Head, J_Bip_C_Head,
# Bip001 Head, DEF-head, head_jnt.
_AROUND = frozenset(
    (
        *("mixamorig", "mixamo", "cc", "base", "j", "bip", "adj", "c", "m", "x", "b", "bn", "sk"),
        *("def", "org", "mch", "bone", "joint", "jnt", "bind", "skin", "rig", "armature"),
        *("character", "avatar", "facial", "valve", "biped"),
    )
)
_JOINT_NAMES: dict[str, tuple[tuple[str, ...], ...]] = {
    "neck": (("neck",), ("neck", "twist"), ("neck", "lower"), ("lower", "neck")),
    "head": (("head",),),
    "jaw": (("jaw",), ("jaw", "root"), ("lower", "jaw"), ("jaw", "lower"), ("mandible",)),
    "eye": (("eye",), ("face", "eye"), ("eyeball",), ("eye", "ball")),
}
SIDES = ("Left", "Right")
JAW_DEG = 20.0
"""How far the built-in head's jaw is turned where `jawOpen` is one."""
SPEECH = frozenset({*curve_names(), "mouthClose"} & set(ARKIT_NAMES))
"""ARKit's shapes that speech uses: a file that has them all needs no fit."""
_RANK = (GIVEN, "vrm", "arkit", "cc", "viseme", "other", "facs")
_GAZE_DEG = {  # nod and turn for a degree of gaze; a left eye looks out to the left
    ("Up", "Left"): (-1, 0),
    ("Up", "Right"): (-1, 0),
    ("Down", "Left"): (1, 0),
    ("Down", "Right"): (1, 0),
    ("In", "Left"): (0, -1),
    ("In", "Right"): (0, 1),
    ("Out", "Left"): (0, 1),
    ("Out", "Right"): (0, -1),
}


@dataclass(frozen=True)
class Candidate:
    """Morph targets that do the same, wherever they are."""

    name: str  # as the file has it
    meaning: Meaning  # what they do
    binds: tuple[tuple[int, int, float], ...]  # mesh, target, weight
    still: bool = False  # whether all are known to move nothing
    switch: bool = False  # whether it is only ever off or on
    overrides: dict[str, str] = field(default_factory=dict)  # what it takes away of others


@dataclass
class Mapping:
    """What takes what, and what is left."""

    controls: list[Control] = field(default_factory=list)  # of the character
    turns: list[Turn] = field(default_factory=list)
    mouth: str = "none"  # "direct", "fitted" or "none"
    idle: dict[str, str] = field(default_factory=dict)  # why a name that is known takes nothing
    # the nearest known name, "" for none, by a name that is not known
    unknown: dict[str, str] = field(default_factory=dict)
    # names that are not known and look like a mouth's
    of_mouth: list[str] = field(default_factory=list)
    # names of targets that are there again and left out, since they move the same
    twice: list[str] = field(default_factory=list)
    # names of targets that somebody explained
    given: list[str] = field(default_factory=list)


def map_character(
    parts: Sequence[HeadPart],
    tree: NodeTree,
    joints: dict[str, int],
    vrm: Vrm | None,
    given: GivenNames,
) -> Mapping:
    """Map the morph targets and joints of a head.

    joints: nodes by the names of the built-in head's joints; vrm: what the file says as a VRM;
    given: what somebody says of its shapes, which holds before all else.
    """
    targets = {name for part in parts for name in part.mesh.targets}
    mapping = Mapping(given=[name for name in given if name in targets])
    morphs = _from_names(parts, mapping, given)
    candidates = _chosen(morphs, _from_vrm(vrm, parts), mapping)
    by_joint = _joint_controls(candidates, joints, vrm)
    turned = {curve for control in by_joint for curve in control.looks}
    moving = []
    for each in candidates:
        if each.still:
            mapping.idle[each.name] = "moves nothing"
        elif turned.issuperset(each.meaning.looks):
            mapping.idle[each.name] = "a joint does it"
        else:
            moving.append(each)
    taken = _shared(moving, by_joint, mapping)
    mapping.controls = [control for control in taken if control.shares or control.looks]
    mapping.turns = _turns(joints, by_joint, vrm)
    return mapping


def head_joints(
    tree: NodeTree, skeleton: Iterable[int], parts: Sequence[HeadPart], vrm: Vrm | None
) -> dict[str, int]:
    """Nodes of neck, head, jaw and eyes of a head, by the names of the built-in head's joints.

    skeleton: the joints of its skins, nothing where it has none. What a VRM says goes first.
    """
    bones = set(skeleton)
    if bones:
        near = set(bones)
        for joint in bones:
            near.update(tree.below(joint) if tree.parents[joint] not in bones else ())
        near.update(*(tree.line(joint) for joint in bones if tree.parents[joint] not in bones))
    else:
        near = {node for part in parts for node in tree.line(part.node)}
        near |= {child for node in set(near) for child in tree.nodes[node].get("children", [])}
    near = {node for node in near if "mesh" not in tree.nodes[node] or node in bones}
    nodes: dict[str, int] = {}
    for node in sorted(near, key=lambda each: (len(tree.line(each)), each)):
        joint = joint_of(tree.name(node))
        if joint is not None:
            nodes.setdefault(joint, node)
    return nodes | (vrm.joints if vrm is not None else {})


def _from_names(
    parts: Sequence[HeadPart], mapping: Mapping, given: GivenNames
) -> dict[str, Candidate]:
    """What the names of morph targets say, over all meshes, by what it does."""
    candidates: dict[str, Candidate] = {}
    meshes = {part.mesh.mesh: part.mesh for part in parts}
    for mesh in meshes.values():
        own: dict[str, list[tuple[int, Meaning]]] = {}
        meanings = meanings_with(mesh.targets, given)
        visemes = any(each is not None and each.family == "viseme" for each in meanings)
        for target, meaning in enumerate(meanings):
            name = mesh.targets[target]
            if meaning is None:
                if name and name not in mapping.unknown:
                    mapping.unknown[name] = nearest_name(name) or ""
                    mapping.of_mouth += [name] if like_a_mouth(name, visemes) else []
            elif not meaning.looks:
                mapping.idle[name] = "left alone" if name in given else "the mouth at rest"
            else:
                own.setdefault(meaning.key, []).append((target, meaning))
        for key, same in own.items():
            same.sort(key=lambda each: (mesh.still[each[0]], _RANK.index(each[1].family)))
            first = same[0][1]
            used = [each for each in same if each[1].part] if first.part else _alike(mesh, same)
            doing = mesh.targets[used[0][0]]
            for target, _ in same:
                if target in [each for each, _ in used]:
                    continue
                if mesh.targets[target] != doing:
                    mapping.idle[mesh.targets[target]] = f"{doing} does it"
                elif not mesh.still[target]:
                    mapping.twice.append(doing)
            binds = tuple((mesh.mesh, target, 1.0) for target, _ in used)
            still = all(mesh.still[target] for target, _ in used)
            name = " + ".join(dict.fromkeys(mesh.targets[target] for target, _ in used))
            old = candidates.get(key)
            if old is None:
                candidates[key] = Candidate(name, first, binds, still)
            else:
                candidates[key] = replace(old, binds=old.binds + binds, still=old.still and still)
    return candidates


def _alike(mesh: MorphMesh, same: list[tuple[int, Meaning]]) -> list[tuple[int, Meaning]]:
    """The first of several targets, and others of its name that move something else: parts that
    were put together in one mesh."""
    targets = {each[0]: each for each in same if mesh.targets[each[0]] == mesh.targets[same[0][0]]}
    moving = [each for target, each in targets.items() if mesh.twins[target] == target]
    return [each for each in moving if not mesh.still[each[0]]] or same[:1]


def _from_vrm(vrm: Vrm | None, parts: Sequence[HeadPart]) -> dict[str, Candidate]:
    """What the expressions of a VRM say, by what they do."""
    candidates: dict[str, Candidate] = {}
    if vrm is None:
        return candidates
    meshes = {part.mesh.mesh: part.mesh for part in parts}
    for expression in sorted(vrm.expressions, key=lambda each: not each.preset):
        meaning = vrm_meaning(expression.name)  # many a custom one is called as a preset
        if meaning is None and not expression.preset:
            (meaning,) = meanings_of([expression.name])
        binds = tuple(bind for bind in expression.binds if bind[0] in meshes)
        if meaning is None or not meaning.looks or not binds:
            continue
        still = all(meshes[mesh].still[target] for mesh, target, _ in binds)
        candidates.setdefault(
            meaning.key,
            Candidate(
                expression.name, meaning, binds, still, expression.switch, expression.overrides
            ),
        )
    return candidates


def _chosen(
    morphs: dict[str, Candidate], expressions: dict[str, Candidate], mapping: Mapping
) -> list[Candidate]:
    """Morph targets alone where they are a whole mouth, else expressions before them."""
    if not expressions or _covered(morphs.values()) >= SPEECH:
        for each in expressions.values():
            mapping.idle.setdefault(each.name, "ARKit's shapes are there")
        return [
            replace(each, overrides=expressions[key].overrides) if key in expressions else each
            for key, each in morphs.items()
        ]
    own = {key for key, each in morphs.items() if each.meaning.family == GIVEN}
    expressions = {key: each for key, each in expressions.items() if key not in own}
    bound = {bind[:2] for each in expressions.values() for bind in each.binds}
    rest = []
    for key, each in morphs.items():
        moved = bound.issuperset(bind[:2] for bind in each.binds)
        if key in expressions or (moved and key not in own):
            mapping.idle[each.name] = "an expression of the VRM moves it"
        else:
            rest.append(each)
    for each in expressions.values():
        mapping.idle.pop(each.name, None)
    return [*expressions.values(), *rest]


def _is_single(looks: dict[str, float]) -> bool:
    return list(looks.values()) == [1.0]


def _covered(candidates: Iterable[Candidate]) -> set[str]:
    """Curves that have a shape of their own, or one together with their other side."""
    return {
        curve
        for each in candidates
        if not each.still and set(each.meaning.looks.values()) == {1.0}
        for curve in each.meaning.looks
    }


def _shared(moving: list[Candidate], by_joint: list[Control], mapping: Mapping) -> list[Control]:
    """Controls with their shares of the curves; a mouth that is not whole is left to the fit."""
    single = {c for each in moving if _is_single(each.meaning.looks) for c in each.meaning.looks}
    single |= {curve for control in by_joint for curve in control.looks}
    taken: list[Control] = []
    for each in moving:
        looks = each.meaning.looks
        alone = _is_single(looks) or (set(looks.values()) == {1.0} and single.isdisjoint(looks))
        shares = {curve: 1 / len(looks) for curve in looks} if alone else {}
        taken.append(Control(each.name, looks, each.binds, shares, each.switch, each.overrides))
    taken += by_joint
    whole = {curve for control in taken if control.shares for curve in control.looks}
    mouth = [control for control in taken if _moves_mouth(control)]
    if whole >= SPEECH:
        mapping.mouth = "direct"
        kept = [control for control in taken if control.shares]
        taken = [_with_speech_shapes(control, whole) for control in kept]
    elif mouth:
        mapping.mouth = "fitted"
        kept = [replace(c, shares={}) if _moves_mouth(c) else c for c in taken]
        taken = [c for c in kept if c.shares or not _is_doubled(c.looks, single)]
    else:
        kept = taken = [control for control in taken if control.shares]
    for each in moving:
        if each.name not in _names(taken):
            mapping.idle[each.name] = "others do it"
    return taken


def _is_doubled(looks: dict[str, float], single: set[str]) -> bool:
    """Whether two sides together have shapes of their own as well."""
    return len(looks) > 1 and set(looks.values()) == {1.0} and single.issuperset(looks)


def _names(controls: Iterable[Control]) -> set[str]:
    return {control.name for control in controls}


def _moves_mouth(control: Control) -> bool:
    return any(map(is_of_mouth, control.looks))


def _with_speech_shapes(control: Control, whole: set[str]) -> Control:
    """The built-in head's own speech shapes, folded into ARKit's as a .glb of it folds them."""
    shares = dict(control.shares)
    for name, stand_ins in NEAREST.items():
        if name in whole or not whole.issuperset(stand_ins):
            continue
        for curve, share in stand_ins.items():
            if curve in control.shares:
                shares[name] = shares.get(name, 0.0) + share * control.shares[curve]
    return replace(control, shares=shares)


def _joint_controls(
    candidates: list[Candidate], joints: dict[str, int], vrm: Vrm | None
) -> list[Control]:
    """What joints do because no shape does: open the jaw, turn the eyes."""
    looks = {curve for each in candidates if not each.still for curve in each.meaning.looks}
    controls = []
    if "jaw" in joints and "jawOpen" not in looks:
        controls.append(Control("joint: jawOpen", {"jawOpen": 1.0}, (), {"jawOpen": 1.0}))
    eyes = [side for side in SIDES if f"eye{side}" in joints]
    by_shapes = any(curve.startswith("eyeLook") for curve in looks)
    if not eyes or (by_shapes and not (vrm is not None and vrm.eyes_by_joints)):
        return controls
    for side in eyes:
        for way in REACH_DEG:
            curve = f"eyeLook{way}{side}"
            controls.append(Control(f"joint: {curve}", {curve: 1.0}, (), {curve: 1.0}))
    return controls


def _turns(joints: dict[str, int], by_joint: list[Control], vrm: Vrm | None) -> list[Turn]:
    """Joints with what turns them; one that is missing hands its turn to the other."""
    turns = []
    if "head" in joints and "neck" in joints:
        turns += [Turn(joints["neck"], ("neck",)), Turn(joints["head"], ("head",))]
    elif "head" in joints or "neck" in joints:
        turns.append(Turn(joints.get("head", joints.get("neck", 0)), ("neck", "head")))
    names = _names(by_joint)
    if "jaw" in joints:
        opened = {"joint: jawOpen": (JAW_DEG, 0.0)} if "joint: jawOpen" in names else {}
        turns.append(Turn(joints["jaw"], ("jaw",), opened))
    for side in SIDES:
        if f"eye{side}" not in joints:
            continue
        degrees = {}
        for way, reach in REACH_DEG.items():
            name = f"joint: eyeLook{way}{side}"
            if name in names:
                scale = reach * (1.0 if vrm is None else vrm.gaze.get(way, 1.0))
                nod, turn = _GAZE_DEG[way, side]
                degrees[name] = (scale * nod, scale * turn)
        turns.append(Turn(joints[f"eye{side}"], (f"eye{side}",), degrees))
    return turns


def joint_of(name: str) -> str | None:
    """Which of the built-in head's joints ("neck", "head", "jaw", "eyeLeft", "eyeRight") a joint is
    by the name that the file has; None for others."""
    words = [word.lower() for word in _JOINT_WORDS.findall(name[:200])]
    sides = {_JOINT_SIDES[word] for word in words if word in _JOINT_SIDES}
    rest = _without_rig(word for word in words if word not in _JOINT_SIDES)
    for joint, known in _JOINT_NAMES.items():
        if rest in known and (len(sides) == 1) == (joint == "eye") and len(sides) < 2:
            return joint + "".join(sides)
    return None


def _without_rig(words: Iterable[str]) -> tuple[str, ...]:
    kept = list(words)
    while kept and kept[0] in _AROUND:
        kept = kept[1:]
    while kept and kept[-1] in _AROUND:
        kept = kept[:-1]
    return tuple(kept)
