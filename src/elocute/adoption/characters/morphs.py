"""Lists the meshes of a file that have morph targets, and groups them into heads.

A head comes in parts, and a file may hold two.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.adoption.characters.shape_names import words_of
from elocute.errors import HeadError
from elocute.files.json_records import finite_number
from elocute.meshes.gltf_document import GltfDocument, morph_targets
from elocute.meshes.gltf_nodes import NodeTree

PAIRS_MAX = 2000
"""Parts of a face; more are taken as they come."""
NAME_MAX = 200
BASIS = frozenset({"basis", "base", "neutral", "default", "rest", "original", "基型", "ベース"})
"""Words for the mesh itself, which some writers name before its morph targets."""


@dataclass(frozen=True)
class MorphMesh:
    """A mesh that can change its shape."""

    mesh: int  # its number in the file
    name: str  # what messages call it
    nodes: tuple[int, ...]  # where it hangs
    targets: tuple[str, ...]  # names of its morph targets; "" for one without a name
    still: tuple[bool, ...]  # which of them are known to move nothing
    # for each of them the first that is called the same and moves the same, often itself
    twins: tuple[int, ...]
    note: str = ""  # what to know of their names; "" for nothing


def morph_meshes(document: GltfDocument) -> list[MorphMesh]:
    """The meshes of a file that have morph targets and hang in its scene, in the file's order."""
    hanging: dict[int, list[int]] = {}
    nodes = document.records("nodes")
    for number in sorted({*NodeTree(document).shown()}):
        if "mesh" in nodes[number]:
            hanging.setdefault(nodes[number]["mesh"], []).append(number)
    meshes = []
    for number, mesh in enumerate(document.records("meshes")):
        targets = morph_targets(mesh)
        if targets and number in hanging:
            called = [mesh.get("name"), *(nodes[node].get("name") for node in hanging[number])]
            name = next((each for each in called if isinstance(each, str) and each), str(number))
            names, note = _target_names(document, mesh, len(targets))
            bounds = [_bounds(document, mesh, place) for place in range(len(targets))]
            meshes.append(
                MorphMesh(
                    number,
                    name[:NAME_MAX],
                    tuple(hanging[number]),
                    tuple(names),
                    tuple(each is not None and not any(each) for each in bounds),
                    tuple(_twins(names, bounds)),
                    note,
                )
            )
    return meshes


def _target_names(
    document: GltfDocument, mesh: dict[str, Any], count: int
) -> tuple[list[str], str]:
    """Where writers put names: extras of the mesh, the primitive or the target, the accessor.

    A list of another length is told. One that is too long does not say which name is whose; one
    that is too short names the first.
    """
    stored, note = list[str](), ""
    for holder in (mesh, *mesh["primitives"]):
        extras = holder.get("extras")
        names = extras.get("targetNames") if isinstance(extras, dict) else None
        if not isinstance(names, list) or not names:
            continue
        stored = [each[:NAME_MAX] if isinstance(each, str) else "" for each in names]
        if len(stored) == count + 1 and not BASIS.isdisjoint(words_of(stored[0])):
            stored = stored[1:]
        if len(stored) == count:
            return stored, ""
        note = f"{len(stored)} names for {count} morph targets, {{}} taken as without names"
    if 0 < len(stored) < count:
        return stored + [""] * (count - len(stored)), note.format("the last of which are")
    own = [_own_name(document, target) for target in morph_targets(mesh)]
    return own, note.format("which are")


def _own_name(document: GltfDocument, target: dict[str, Any]) -> str:
    extras, position = target.get("extras"), target.get("POSITION")
    name = extras.get("name") if isinstance(extras, dict) else None
    if name is None and position is not None:
        name = document.records("accessors")[position].get("name")
    return name[:NAME_MAX] if isinstance(name, str) else ""


def _twins(names: list[str], bounds: list[tuple[float, ...] | None]) -> Iterator[int]:
    first: dict[tuple[str, tuple[float, ...]], int] = {}
    for place, (name, ends) in enumerate(zip(names, bounds, strict=True)):
        yield place if ends is None else first.setdefault((name, ends), place)


def _bounds(document: GltfDocument, mesh: dict[str, Any], place: int) -> tuple[float, ...] | None:
    """How far a target moves the primitives, least and most; None where the file does not say."""
    bounds = list[float]()
    for targets in (each["targets"] for each in mesh["primitives"] if each.get("targets")):
        for numbers in _stated_ends(document, targets[place]):
            if numbers is None:
                return None
            bounds += numbers
    return tuple(bounds)


def _stated_ends(
    document: GltfDocument, attributes: dict[str, int]
) -> Iterator[list[float] | None]:
    """Least and most of positions as the file states them, where it does so in three numbers."""
    if "POSITION" in attributes:
        accessor = document.records("accessors")[attributes["POSITION"]]
        for end in (accessor.get("min"), accessor.get("max")):
            numbers = [finite_number(value) for value in end] if isinstance(end, list) else []
            finite = [number for number in numbers if number is not None]
            yield finite if len(numbers) == len(finite) == 3 else None


@dataclass(frozen=True)
class HeadPart:
    """A mesh where it hangs."""

    node: int
    mesh: MorphMesh
    speaks: bool  # whether the mesh has shapes of a mouth


def choose_head(
    subject: str,
    document: GltfDocument,
    tree: NodeTree,
    parts: Sequence[HeadPart],
    mesh: str | None,
) -> list[HeadPart]:
    """The parts of one head, of all meshes with shapes of a face.

    mesh: the name of a mesh or of its node; None where there is one head only. Raises HeadError for
    several heads of which none is named, and for a name that no mesh has.
    """
    heads = _heads(document, tree, parts)
    if mesh is not None:
        named = [head for head in heads if any(mesh in _names(part, tree) for part in head)]
        if len(named) == 1:
            return named[0]
        names = ", ".join(dict.fromkeys(_telling_name(part, heads, tree) for part in parts))
        found = f"{len(named)} meshes called {mesh!r}" if named else f"no mesh called {mesh!r}"
        raise HeadError.about(subject, found=found, allowed=names[:300])
    talking = [head for head in heads if any(part.speaks for part in head)]
    if len(talking) > 1:
        names = [[_telling_name(part, heads, tree) for part in head] for head in talking]
        meshes = "; ".join(", ".join(dict.fromkeys(each)) for each in names)
        speaking = [part.speaks for part in talking[0]].index(True)
        raise HeadError.about(
            subject,
            found=f"{len(talking)} heads ({meshes[:300]})",
            allowed="one",
            remedy=f"`mesh` {names[0][speaking]} chooses the first of them",
        )
    return list(parts)


def _telling_name(part: HeadPart, heads: Sequence[Sequence[HeadPart]], tree: NodeTree) -> str:
    """The first of its names that chooses its head alone."""
    names = _names(part, tree)
    owners = {name: [h for h in heads if any(name in _names(p, tree) for p in h)] for name in names}
    return next((name for name in names if name and len(owners[name]) == 1), names[-1])


def _names(part: HeadPart, tree: NodeTree) -> tuple[str, str, str]:
    """What a mesh is called where it hangs: as itself, as its node, and by the node's number."""
    return part.mesh.name, tree.name(part.node), f"node {part.node}"


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
    corners = [
        end
        for primitive in document.records("meshes")[part.mesh.mesh]["primitives"]
        for end in _stated_ends(document, primitive["attributes"])
        if end is not None
    ]
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
