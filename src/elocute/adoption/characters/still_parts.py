"""Names eyes, teeth and tongues of a file that neither shapes nor joints move."""

from __future__ import annotations

import re
from collections.abc import Iterable

from elocute.head.character import Turn
from elocute.meshes.gltf_document import GltfDocument
from elocute.meshes.gltf_nodes import NodeTree

_OF_EYES = ("eye", "eyes", "eyeball", "eyeballs", "iris", "irises", "cornea", "pupil", "pupils")
_OF_JAW = ("teeth", "tooth", "tongue", "gum", "gums", "denture", "dentures")
_ABOVE = ("upper", "up", "top", "maxilla")
"""Teeth of the skull, which stay where they are."""


def still_parts(
    document: GltfDocument, tree: NodeTree, moved: Iterable[int], turns: Iterable[Turn]
) -> list[str]:
    """Meshes that are eyes, teeth or a tongue by their names, and stay as they are.

    Parameters
    ----------
    document : GltfDocument
        The file.
    tree : NodeTree
        Its nodes.
    moved : iterable of int
        Meshes whose shapes are moved.
    turns : iterable of Turn
        The joints that are turned.

    Returns
    -------
    list of str
        Their names, each once.
    """
    moved, found = set(moved), []
    by_kind: dict[str, set[int]] = {"eye": set(), "jaw": set()}
    for turn in turns:
        for joint in turn.joints if turn.controls else ():
            if joint[:3] in by_kind:
                by_kind[joint[:3]].update(tree.below(turn.node))
    for number, node in enumerate(tree.nodes):
        if "mesh" not in node or node["mesh"] in moved:
            continue
        name, kind = _kind(document, tree, number)
        if kind and not _hangs_on(document, tree, number, by_kind[kind]):
            found.append(name)
    return list(dict.fromkeys(found))


def _kind(document: GltfDocument, tree: NodeTree, number: int) -> tuple[str, str]:
    """What a mesh is called, and "eye", "jaw" or "" by that."""
    mesh = document.records("meshes")[tree.nodes[number]["mesh"]]
    given = mesh.get("name")
    names = [each for each in (tree.name(number), given) if isinstance(each, str) and each]
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
