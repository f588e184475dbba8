"""Groups the meshes of a file into heads: a head comes in parts, and a file may hold two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.adoption.characters.morphs import MorphMesh
from elocute.errors import HeadError
from elocute.files.json_records import finite_number
from elocute.meshes.gltf_document import GltfDocument
from elocute.meshes.gltf_nodes import NodeTree

PAIRS_MAX = 2000
"""Parts of a face; more are taken as they come."""


@dataclass(frozen=True)
class HeadPart:
    """A mesh where it hangs.

    Attributes
    ----------
    node : int
        The node.
    mesh : MorphMesh
        Its mesh.
    speaks : bool
        Whether the mesh has shapes of a mouth.
    """

    node: int
    mesh: MorphMesh
    speaks: bool


def choose_head(
    subject: str,
    document: GltfDocument,
    tree: NodeTree,
    parts: Sequence[HeadPart],
    mesh: str | None,
) -> list[HeadPart]:
    """The parts of one head.

    Parameters
    ----------
    subject : str
        The file, for messages.
    document : GltfDocument
        Read.
    tree : NodeTree
        Its nodes.
    parts : sequence of HeadPart
        All meshes with shapes of a face.
    mesh : str or None
        The name of a mesh or of its node; None where there is one head only.

    Returns
    -------
    list of HeadPart

    Raises
    ------
    HeadError
        For several heads of which none is named, and for a name that no mesh has.
    """
    heads = _heads(document, tree, parts)
    if mesh is not None:
        named = [head for head in heads if any(_is_called(part, tree, mesh) for part in head)]
        if len(named) == 1:
            return named[0]
        names = ", ".join(dict.fromkeys(part.mesh.name for part in parts))
        found = f"{len(named)} meshes called {mesh!r}" if named else f"no mesh called {mesh!r}"
        raise HeadError.about(subject, found=found, allowed=names[:300])
    talking = [head for head in heads if any(part.speaks for part in head)]
    if len(talking) > 1:
        told = "; ".join(", ".join(dict.fromkeys(p.mesh.name for p in head)) for head in talking)
        first = talking[0][0]
        called = next((p.mesh.name for p in talking[0] if p.speaks), first.mesh.name)
        raise HeadError.about(
            subject,
            found=f"{len(talking)} heads ({told[:300]})",
            allowed="one",
            remedy=f"`mesh` {called} chooses the first of them",
        )
    return list(parts)


def _is_called(part: HeadPart, tree: NodeTree, name: str) -> bool:
    return name in (part.mesh.name, tree.name(part.node))


def _heads(
    document: GltfDocument, tree: NodeTree, parts: Sequence[HeadPart]
) -> list[list[HeadPart]]:
    """Parts of one skeleton belong together, of others those that lie in each other."""
    skeletons = [_skeleton(document, tree, part.node) for part in parts]
    boxes = [_box(document, tree, part) for part in parts[:PAIRS_MAX]]
    boxes += [None] * (len(parts) - len(boxes))
    group = list(range(len(parts)))
    for one in range(len(parts)):
        for other in range(one):
            if group[one] != group[other] and _together(
                skeletons[one], skeletons[other], boxes[one], boxes[other]
            ):
                old, new = group[one], group[other]
                group = [new if each == old else each for each in group]
    return [
        [part for part, each in zip(parts, group, strict=True) if each == number]
        for number in dict.fromkeys(group)
    ]


_Box = NDArray[np.float64] | None


def _together(one: frozenset[int], other: frozenset[int], box: _Box, other_box: _Box) -> bool:
    if one and other:
        return not one.isdisjoint(other)
    if box is None or other_box is None:
        return True
    return _inside(box, other_box) or _inside(other_box, box)


def _inside(small: NDArray[np.float64], large: NDArray[np.float64]) -> bool:
    """Whether the middle of a box lies in another."""
    middle = small.mean(axis=0)
    return bool(((middle >= large[0]) & (middle <= large[1])).all())


def _skeleton(document: GltfDocument, tree: NodeTree, node: int) -> frozenset[int]:
    """The joints that move a node: of its skin, or those that it hangs from."""
    skins = document.records("skins")
    skin = tree.nodes[node].get("skin")
    if skin is not None:
        return frozenset(skins[skin]["joints"])
    above = set(tree.line(node))
    for each in skins:
        if not above.isdisjoint(each["joints"]):
            return frozenset(each["joints"])
    return frozenset()


def _box(document: GltfDocument, tree: NodeTree, part: HeadPart) -> _Box:
    """(2, 3) lowest and highest corner in the scene, by the bounds that the file states."""
    accessors, corners = document.records("accessors"), []
    for primitive in document.records("meshes")[part.mesh.mesh]["primitives"]:
        position = primitive["attributes"].get("POSITION")
        ends = [] if position is None else [accessors[position].get(end) for end in ("min", "max")]
        for end in ends:
            numbers = [finite_number(value) for value in end] if isinstance(end, list) else []
            if len(numbers) == 3 and None not in numbers:
                corners.append(numbers)
    if len(corners) < 2:
        return None
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    eight = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), -1).reshape(-1, 3)
    world = np.eye(4) if "skin" in tree.nodes[part.node] else tree.world(part.node)
    with np.errstate(all="ignore"):
        placed = eight @ world[:3, :3].T + world[:3, 3]
    if not np.isfinite(placed).all():
        return None
    return np.stack([placed.min(axis=0), placed.max(axis=0)])
