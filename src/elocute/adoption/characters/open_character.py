"""Opens a character's file as a head: the built-in head with the file and the mapping beside it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from elocute.adoption.characters.given_names import (
    GivenNames,
    meanings_with,
    names_path,
    read_given_names,
)
from elocute.adoption.characters.mapping import Mapping, head_joints, map_character
from elocute.adoption.characters.morphs import HeadPart, MorphMesh, choose_head, morph_meshes
from elocute.adoption.characters.stance import Stance, stance_of
from elocute.adoption.characters.vrm import Vrm, read_vrm
from elocute.errors import HeadError
from elocute.head.builtin import load_builtin_head
from elocute.head.character import Character, Turn
from elocute.head.model import HeadModel
from elocute.meshes.gltf_document import GltfDocument, read_gltf
from elocute.meshes.gltf_nodes import NodeTree, without_matrix
from elocute.motion.control_fit import is_of_mouth

_OF_EYES = ("eye", "eyes", "eyeball", "eyeballs", "iris", "irises", "cornea", "pupil", "pupils")
_OF_JAW = ("teeth", "tooth", "tongue", "gum", "gums", "denture", "dentures")
_ABOVE = ("upper", "up", "top", "maxilla")
"""Teeth of the skull, which stay where they are."""
TOLD = 6
"""Names that a note has."""
REMEDY = "export it with its shape keys, named as ARKit, Oculus or VRM names them"


class UnknownShapesError(HeadError):
    """A character without a mouth among the names that are known; `names`: the others."""

    names: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class OpenedCharacter:
    """A character and how it was understood."""

    character: Character  # ready to be moved
    mapping: Mapping  # what takes what, and what is left
    meshes: tuple[MorphMesh, ...]  # the meshes of its head
    still: tuple[str, ...] = ()  # eyes, teeth and tongues that nothing moves


def open_character(path: str | Path, mesh: str | None = None) -> OpenedCharacter:
    """Read a character from a glTF file or a VRM.

    Parameters
    ----------
    path : str or Path
        A .glb, .gltf or .vrm with everything inside, or an .fbx. What `NAME.names.json` beside it
        says of its shapes holds before their names.
    mesh : str, optional
        The name of a mesh of the head, where the file has several heads.

    Returns
    -------
    OpenedCharacter

    Raises
    ------
    HeadError
        For a file that is missing, damaged or kept in parts, without morph targets of a face, or
        with several heads of which none is named; UnknownShapesError where no name is known.
    """
    path = Path(path)
    document = read_gltf(path, error=HeadError)
    return character_of(document, path, mesh, read_given_names(path))


def character_of(
    document: GltfDocument, path: Path, mesh: str | None, given: GivenNames
) -> OpenedCharacter:
    """The character of a file that was read; path: its name; given: what is said of its shapes.

    Raises HeadError.
    """
    tree, vrm = NodeTree(document), read_vrm(document)
    meshes = morph_meshes(document)
    if not meshes:
        raise HeadError.about(path, found="no morph targets", allowed="a face", remedy=REMEDY)
    parts = _parts(meshes, vrm, given)
    if not parts:
        raise _unknown_shapes(path, meshes, given)
    chosen = choose_head(str(path), document, tree, parts, mesh)
    joints = {
        joint: node
        for joint, node in head_joints(tree, _skeleton(document, chosen), chosen, vrm).items()
        if without_matrix(tree.nodes[node]) is not None
    }
    mapping = map_character(chosen, tree, joints, vrm, given)
    if mapping.mouth == "none":
        known = ", ".join(control.name for control in mapping.controls)
        found = f"no shape that moves a mouth ({known[:200]})"
        raise _unknown_shapes(path, meshes, given, found)
    moved = {bind[0] for control in mapping.controls for bind in control.binds}
    still = still_parts(document, tree, moved, mapping.turns) if mesh is None else []
    character = Character(
        path.name[:200],
        document,
        tuple(dict.fromkeys(part.node for part in chosen if part.mesh.mesh in moved)),
        tuple(mapping.controls),
        tuple(mapping.turns),
    )
    stance = stance_of(character, tree, joints, vrm)
    character = replace(
        character,
        facing_deg=stance.facing_deg,
        tilt_deg=stance.tilt_deg,
        notes=tuple(_notes(path, mapping, still, meshes, given, stance)),
    )
    heads = tuple({part.mesh.mesh: part.mesh for part in chosen}.values())
    return OpenedCharacter(character, mapping, heads, tuple(still))


def _unknown_shapes(
    path: Path, meshes: list[MorphMesh], given: GivenNames, found: str = ""
) -> UnknownShapesError:
    names = {name: None for each in meshes for name in each.targets if name}
    reason = ", ".join(names) or next((m.note for m in meshes if m.note), "which have no names")
    error = UnknownShapesError.about(
        path,
        found=found or f"none known among its morph targets ({reason[:200]})",
        allowed="shapes of a mouth",
        remedy=f"{REMEDY}, or say what they do in {names_path(path).name}",
    )
    unknown = zip(names, meanings_with(list(names), given), strict=True)
    error.names = tuple(name for name, meaning in unknown if meaning is None)
    return error


def _notes(
    path: Path,
    mapping: Mapping,
    still: list[str],
    meshes: list[MorphMesh],
    given: GivenNames,
    stance: Stance,
) -> Iterator[str]:
    """What to know before it speaks. A mouth that takes the curves as they are needs no more."""
    name = path.name[:200]
    if nowhere := [each for each in given if each not in mapping.given]:
        yield f"{names_path(path).name}: no shapes of {name}: {_first_names(nowhere)}"
    yield from (f"{name}: {mesh.name} has {mesh.note}" for mesh in meshes if mesh.note)
    if mapping.twice:
        shown = _first_names(mapping.twice)
        yield f"{name}: shapes of one name that move the same ({shown}): the first of each is moved"
    unknown = mapping.of_mouth
    if mapping.mouth == "fitted" and unknown:
        found = f"{len(unknown)} shapes look like a mouth's and are not known"
        shown = _first_names(unknown)
        yield f"{name}: {found} ({shown}): nothing moves them; `elocute info` lists all"
    if still:
        shown = _first_names(still)
        yield f"{name}: {shown} without shapes and joints that move: as they are throughout"
    if not stance.told:
        found = "neither joints of eyes nor shapes tell which way its face looks"
        yield f"{name}: {found}: taken to look along +Z; name its eyes' joints LeftEye and RightEye"


def _first_names(names: list[str]) -> str:
    return ", ".join(names[:TOLD]) + (", …" if len(names) > TOLD else "")


def character_head(character: Character) -> HeadModel:
    """The built-in head as it stands for a character, whose its curves and joints are.

    It has neither identities nor a look.
    """
    head = load_builtin_head()
    return replace(
        head,
        name=character.name,
        identity_basis=head.identity_basis[:0],
        joint_identity_basis=head.joint_identity_basis[:0],
        tone_basis=head.tone_basis[:0],
        trait_basis=head.trait_basis[:0],
        look=None,
        character=character,
    )


def _parts(meshes: list[MorphMesh], vrm: Vrm | None, given: GivenNames) -> list[HeadPart]:
    """The meshes that have shapes of a face, each where it hangs."""
    bound = {bind[0] for each in (vrm.expressions if vrm else ()) for bind in each.binds}
    parts = []
    for mesh in meshes:
        looks = [each.looks for each in meanings_with(mesh.targets, given) if each is not None]
        if any(looks) or mesh.mesh in bound:
            speaks = mesh.mesh in bound or any(is_of_mouth(name) for each in looks for name in each)
            parts += [HeadPart(node, mesh, speaks) for node in mesh.nodes]
    return parts


def _skeleton(document: GltfDocument, parts: list[HeadPart]) -> list[int]:
    nodes, skins = document.records("nodes"), document.records("skins")
    joints = [skins[nodes[p.node]["skin"]]["joints"] for p in parts if "skin" in nodes[p.node]]
    return [joint for each in joints for joint in each]


def still_parts(
    document: GltfDocument, tree: NodeTree, moved: Iterable[int], turns: Iterable[Turn]
) -> list[str]:
    """Names of meshes that are eyes, teeth or a tongue by these, and stay as they are.

    moved: meshes whose shapes are moved; turns: the joints that are turned.
    """
    moved, parts = set(moved), []
    by_kind: dict[str, set[int]] = {"eye": set(), "jaw": set()}
    for turn in turns:
        for joint in turn.joints if turn.controls else ():
            if joint[:3] in by_kind:
                by_kind[joint[:3]].update(tree.below(turn.node))
    for number in sorted({*tree.shown()}):
        node = tree.nodes[number]
        if "mesh" not in node or node["mesh"] in moved:
            continue
        name, kind = _kind(document, tree, number)
        if kind and not _hangs_on(document, tree, number, by_kind[kind]):
            parts.append(name)
    return list(dict.fromkeys(parts))


def _kind(document: GltfDocument, tree: NodeTree, number: int) -> tuple[str, str]:
    """What a mesh is called, and "eye", "jaw" or "" by that."""
    mesh = document.records("meshes")[tree.nodes[number]["mesh"]]
    mesh_name = mesh.get("name")
    names = [each for each in (tree.name(number), mesh_name) if isinstance(each, str) and each]
    for name in names:
        words = {word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)}
        if words.isdisjoint(_ABOVE) and not words.isdisjoint(_OF_JAW):
            return name[:200], "jaw"
        if not words.isdisjoint(_OF_EYES) and words.isdisjoint(("lash", "lashes", "brow", "brows")):
            return name[:200], "eye"
    return (names or [""])[0], ""


def _hangs_on(document: GltfDocument, tree: NodeTree, number: int, joints: set[int]) -> bool:
    """Whether a node or a joint of its skin is one of these."""
    skin = tree.nodes[number].get("skin")
    held = document.records("skins")[skin]["joints"] if skin is not None else tree.line(number)
    return not joints.isdisjoint(held)
