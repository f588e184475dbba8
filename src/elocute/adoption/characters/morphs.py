"""The meshes of a file that have morph targets, and what those are called."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from elocute.files.gltf_document import GltfDocument
from elocute.files.json_records import finite_number

NAME_MAX = 200


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
    """

    mesh: int
    name: str
    nodes: tuple[int, ...]
    targets: tuple[str, ...]
    still: tuple[bool, ...]


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
            names = [mesh.get("name"), *(nodes[node].get("name") for node in hanging[number])]
            name = next((each for each in names if isinstance(each, str) and each), str(number))
            found.append(
                MorphMesh(
                    number,
                    name[:NAME_MAX],
                    tuple(hanging[number]),
                    tuple(_target_names(document, mesh, len(targets))),
                    tuple(_is_still(document, mesh, place) for place in range(len(targets))),
                )
            )
    return found


def _target_names(document: GltfDocument, mesh: dict[str, Any], count: int) -> list[str]:
    """Where writers put names: extras of the mesh, the primitive or the target, the accessor."""
    first = mesh["primitives"][0]
    for holder in (mesh, *mesh["primitives"]):
        extras = holder.get("extras")
        names = extras.get("targetNames") if isinstance(extras, dict) else None
        if isinstance(names, list) and names:
            given = [each[:NAME_MAX] if isinstance(each, str) else "" for each in names[:count]]
            return given + [""] * (count - len(given))
    return [_own_name(document, target) for target in first["targets"]]


def _own_name(document: GltfDocument, target: dict[str, Any]) -> str:
    extras, position = target.get("extras"), target.get("POSITION")
    name = extras.get("name") if isinstance(extras, dict) else None
    if name is None and position is not None:
        name = document.records("accessors")[position].get("name")
    return name[:NAME_MAX] if isinstance(name, str) else ""


def _is_still(document: GltfDocument, mesh: dict[str, Any], place: int) -> bool:
    """Whether a target's bounds, where the file states them, say that it moves nothing."""
    for primitive in mesh["primitives"]:
        position = primitive["targets"][place].get("POSITION")
        if position is None:
            continue
        accessor = document.records("accessors")[position]
        ends = [accessor.get("min"), accessor.get("max")]
        if not all(isinstance(end, list) and len(end) == 3 for end in ends):
            return False
        if any(finite_number(value) != 0 for end in ends for value in end):
            return False
    return True
