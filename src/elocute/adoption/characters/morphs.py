"""Lists the meshes of a file that have morph targets, with the targets' names."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from elocute.adoption.characters.shape_names import words_of
from elocute.files.json_records import finite_number
from elocute.meshes.gltf_document import GltfDocument

NAME_MAX = 200
BASIS = frozenset({"basis", "base", "neutral", "default", "rest", "original", "基型", "ベース"})
"""Words for the mesh itself, which some writers name before its morph targets."""


@dataclass(frozen=True)
class MorphMesh:
    """A mesh that can change its shape.

    Attributes
    ----------
    mesh : int
        Its number in the file.
    name : str
        What messages call it.
    nodes : tuple of int
        Where it hangs.
    targets : tuple of str
        Names of its morph targets; "" for one without a name.
    still : tuple of bool
        Which of them are known to move nothing.
    twins : tuple of int
        For each of them the first that is called the same and moves the same, often itself.
    note : str
        What to know of their names; "" for nothing.
    """

    mesh: int
    name: str
    nodes: tuple[int, ...]
    targets: tuple[str, ...]
    still: tuple[bool, ...]
    twins: tuple[int, ...]
    note: str = ""


def morph_meshes(document: GltfDocument) -> list[MorphMesh]:
    """The meshes of a file that have morph targets and hang somewhere.

    Parameters
    ----------
    document : GltfDocument
        The file.

    Returns
    -------
    list of MorphMesh
        In the file's order.
    """
    hanging: dict[int, list[int]] = {}
    nodes = document.records("nodes")
    for number, node in enumerate(nodes):
        if "mesh" in node:
            hanging.setdefault(node["mesh"], []).append(number)
    found = []
    for number, mesh in enumerate(document.records("meshes")):
        targets = mesh["primitives"][0].get("targets", [])
        if targets and number in hanging:
            called = [mesh.get("name"), *(nodes[node].get("name") for node in hanging[number])]
            name = next((each for each in called if isinstance(each, str) and each), str(number))
            names, note = _target_names(document, mesh, len(targets))
            bounds = [_bounds(document, mesh, place) for place in range(len(targets))]
            found.append(
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
    return found


def _target_names(
    document: GltfDocument, mesh: dict[str, Any], count: int
) -> tuple[list[str], str]:
    """Where writers put names: extras of the mesh, the primitive or the target, the accessor.

    A list of another length is told. One that is too long does not say which name is whose; one
    that is too short names the first.
    """
    given, note = list[str](), ""
    for holder in (mesh, *mesh["primitives"]):
        extras = holder.get("extras")
        names = extras.get("targetNames") if isinstance(extras, dict) else None
        if not isinstance(names, list) or not names:
            continue
        given = [each[:NAME_MAX] if isinstance(each, str) else "" for each in names]
        if len(given) == count + 1 and not BASIS.isdisjoint(words_of(given[0])):
            given = given[1:]
        if len(given) == count:
            return given, ""
        note = f"{len(given)} names for {count} morph targets, {{}} taken as without names"
    if 0 < len(given) < count:
        return given + [""] * (count - len(given)), note.format("the last of which are")
    own = [_own_name(document, target) for target in mesh["primitives"][0]["targets"]]
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
    accessors, found = document.records("accessors"), list[float]()
    for primitive in mesh["primitives"]:
        position: int | None = primitive["targets"][place].get("POSITION")
        accessor = {} if position is None else accessors[position]
        for end in () if position is None else ("min", "max"):
            given = accessor.get(end)
            values = [*map(finite_number, given)] if isinstance(given, list) else []
            numbers = [value for value in values[:4] if value is not None]
            if len(values) != 3 or len(numbers) != 3:
                return None
            found += numbers
    return tuple(found)
