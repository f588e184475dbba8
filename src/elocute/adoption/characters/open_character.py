"""Opens a character's file as a head: the built-in head with the file and the mapping beside it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from elocute.adoption.characters.heads_in_file import HeadPart, choose_head
from elocute.adoption.characters.mapping import Mapping, facing_deg, head_joints, map_character
from elocute.adoption.characters.morphs import MorphMesh, morph_meshes
from elocute.adoption.characters.shape_names import meanings_of
from elocute.adoption.characters.still_parts import still_parts
from elocute.adoption.characters.vrm import Vrm, read_vrm
from elocute.errors import HeadError
from elocute.head.builtin import load_builtin_head
from elocute.head.character import Character
from elocute.head.model import HeadModel
from elocute.meshes.gltf_document import GltfDocument, read_gltf
from elocute.meshes.gltf_nodes import NodeTree, without_matrix
from elocute.motion.control_fit import is_of_mouth

TOLD = 6
"""Names that a note has."""
REMEDY = "export it with its shape keys, named as ARKit, Oculus or VRM names them"


@dataclass(frozen=True, eq=False)
class OpenedCharacter:
    """A character and how it was understood.

    Attributes
    ----------
    character : Character
        Ready to be moved.
    mapping : Mapping
        What takes what, and what is left.
    meshes : tuple of MorphMesh
        The meshes of its head.
    still : tuple of str
        Eyes, teeth and tongues that nothing moves.
    """

    character: Character
    mapping: Mapping
    meshes: tuple[MorphMesh, ...]
    still: tuple[str, ...] = ()


def open_character(path: str | Path, mesh: str | None = None) -> OpenedCharacter:
    """Read a character from a glTF file or a VRM.

    Parameters
    ----------
    path : str or Path
        A .glb, .gltf or .vrm with everything inside, or an .fbx.
    mesh : str, optional
        The name of a mesh of the head, where the file has several heads.

    Returns
    -------
    OpenedCharacter

    Raises
    ------
    HeadError
        For a file that is missing, damaged or kept in parts, without morph targets of a face, or
        with several heads of which none is named.
    """
    path = Path(path)
    return character_of(read_gltf(path, error=HeadError), path, mesh)


def character_of(document: GltfDocument, path: Path, mesh: str | None = None) -> OpenedCharacter:
    """The character of a file that was read; path: its name. Raises HeadError."""
    tree, vrm = NodeTree(document), read_vrm(document)
    meshes = morph_meshes(document)
    if not meshes:
        raise HeadError.about(path, found="no morph targets", allowed="a face", remedy=REMEDY)
    parts = _parts(meshes, vrm)
    if not parts:
        names = ", ".join(name for each in meshes for name in each.targets if name)
        told = names or next((each.note for each in meshes if each.note), "which have no names")
        found = f"none known among its morph targets ({told[:200]})"
        raise HeadError.about(path, found=found, allowed="shapes of a mouth", remedy=REMEDY)
    chosen = choose_head(str(path), document, tree, parts, mesh)
    joints = {
        joint: node
        for joint, node in head_joints(tree, _skeleton(document, chosen), chosen, vrm).items()
        if without_matrix(tree.nodes[node]) is not None
    }
    mapping = map_character(chosen, tree, joints, vrm)
    if mapping.mouth == "none":
        known = ", ".join(control.name for control in mapping.controls)
        found = f"no shape that moves a mouth ({known[:200]})"
        raise HeadError.about(path, found=found, allowed="shapes of a mouth", remedy=REMEDY)
    moved = {bind[0] for control in mapping.controls for bind in control.binds}
    still = still_parts(document, tree, moved, mapping.turns) if mesh is None else []
    character = Character(
        path.name[:200],
        document,
        tuple(dict.fromkeys(part.node for part in chosen if part.mesh.mesh in moved)),
        tuple(mapping.controls),
        tuple(mapping.turns),
        facing_deg(tree, joints, vrm),
        tuple(_notes(path.name[:200], mapping, still, meshes)),
    )
    heads = tuple({part.mesh.mesh: part.mesh for part in chosen}.values())
    return OpenedCharacter(character, mapping, heads, tuple(still))


def _notes(name: str, mapping: Mapping, still: list[str], meshes: list[MorphMesh]) -> Iterator[str]:
    """What to know before it speaks. A mouth that takes the curves as they are needs no more."""
    yield from (f"{name}: {mesh.name} has {mesh.note}" for mesh in meshes if mesh.note)
    if mapping.twice:
        told = ", ".join(mapping.twice[:TOLD]) + (", …" if len(mapping.twice) > TOLD else "")
        yield f"{name}: shapes of one name that move the same ({told}): the first of each is moved"
    unknown = mapping.of_mouth
    if mapping.mouth == "fitted" and unknown:
        told = ", ".join(unknown[:TOLD]) + (", …" if len(unknown) > TOLD else "")
        found = f"{len(unknown)} shapes look like a mouth's and are not known"
        yield f"{name}: {found} ({told}): nothing moves them; `elocute info` lists all"
    if still:
        told = ", ".join(still[:TOLD]) + (", …" if len(still) > TOLD else "")
        yield f"{name}: {told} without shapes and joints that move: as they are throughout"


def character_head(character: Character) -> HeadModel:
    """The built-in head as it stands for a character.

    Parameters
    ----------
    character : Character
        The character.

    Returns
    -------
    HeadModel
        Without identities and look; its curves and joints are the character's.
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


def _parts(meshes: list[MorphMesh], vrm: Vrm | None) -> list[HeadPart]:
    """The meshes that have shapes of a face, each where it hangs."""
    bound = {bind[0] for each in (vrm.expressions if vrm else ()) for bind in each.binds}
    parts = []
    for mesh in meshes:
        looks = [each.looks for each in meanings_of(mesh.targets) if each is not None]
        if any(looks) or mesh.mesh in bound:
            speaks = mesh.mesh in bound or any(is_of_mouth(name) for each in looks for name in each)
            parts += [HeadPart(node, mesh, speaks) for node in mesh.nodes]
    return parts


def _skeleton(document: GltfDocument, parts: list[HeadPart]) -> list[int]:
    nodes, skins = document.records("nodes"), document.records("skins")
    joints = [skins[nodes[p.node]["skin"]]["joints"] for p in parts if "skin" in nodes[p.node]]
    return [joint for each in joints for joint in each]
