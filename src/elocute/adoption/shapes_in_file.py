"""Adds ARKit's 52 shapes to a mesh's own glTF file as morph targets; the rest stays.

Nodes, joints, materials, pictures, extras and animations stay letter by letter; lips that stood
apart get new positions, since they have to meet.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.adoption.mesh_without_shapes import MeshAdoption
from elocute.array_types import Float64Array
from elocute.errors import HeadError
from elocute.head.normals import morphed_normals
from elocute.meshes.gltf_additions import GltfAdditions, with_value
from elocute.meshes.gltf_arrays import GltfArrays, has_draco
from elocute.meshes.gltf_document import GltfDocument
from elocute.meshes.mesh_file import MeshPart, PartOrigin
from elocute.motion.curves import ARKIT_NAMES

STILL_M = 1e-6
"""What moves less does not move."""
NORMAL_STEP = 0.02
"""Changes of unit normals that are left out."""
FLAT = 1e-12


@dataclass(frozen=True, eq=False)
class _Move:
    """What becomes of one primitive's vertices, in its own space."""

    origin: PartOrigin
    closing: Float64Array  # (vertex, 3) what brings its lips together
    # (52, vertex, 3) displacements, and changes of the unit normals; zero where there are none
    shapes: Float64Array
    turns: Float64Array


def with_arkit_shapes(adopted: MeshAdoption, name: str) -> bytes:
    """The file of a mesh with the shapes that it took over.

    Parameters
    ----------
    adopted : MeshAdoption
        Of a glTF file.
    name : str
        What messages call the file.

    Returns
    -------
    bytes
        A .glb whose moved meshes have ARKit's 52 names as morph targets.

    Raises
    ------
    HeadError
        For a file that is no glTF or packed by Draco, and where a mesh that moves has morph
        targets already, hangs in several places or is scaled to nothing.
    """
    document = adopted.document
    if document is None or has_draco(document):
        found = "a mesh packed by Draco" if document else "a mesh that is no glTF"
        raise HeadError.about(
            name, found=found, allowed="a .glb, .gltf, .vrm or .fbx with plain vertices"
        )
    moves: dict[int, dict[int, _Move]] = {}
    for move in _moves(adopted, name):
        moves.setdefault(move.origin.mesh, {})[move.origin.primitive] = move
    added, arrays, text = GltfAdditions(document), GltfArrays(document), document.text
    for mesh, primitives in moves.items():
        _check_mesh(document, mesh, name)
        text = _with_shapes(text, document, added, arrays, mesh, primitives)
    return added.pack(text)


def _moves(adopted: MeshAdoption, name: str) -> list[_Move]:
    """What moves; parts that nothing moves are left out."""
    head = adopted.adoption.head
    chosen = [head.expression_index(each) for each in ARKIT_NAMES]
    basis = head.expression_basis[chosen].astype(np.float64)
    basis[np.abs(basis).max(axis=2) < STILL_M] = 0
    turns = np.zeros(basis.shape, np.float32)
    changes = morphed_normals(head.template.astype(np.float64), head.triangles, basis)
    for turn, (near, change) in zip(turns, changes, strict=True):
        clear = np.linalg.norm(change, axis=1) > NORMAL_STEP
        turn[near[clear]] = change[clear]
    closing = adopted.closing.copy()
    closing[np.abs(closing).max(axis=1) < STILL_M] = 0
    unit = np.cbrt(abs(np.linalg.det(adopted.to_scene)))
    moves = []
    for part, place in zip(adopted.parts, adopted.places, strict=True):
        assert part.origin is not None
        if not basis[:, place].any() and not closing[place].any():
            continue
        back, size = _back(part, part.origin, name)
        moves.append(
            _Move(
                part.origin,
                np.einsum("vab,vb->va", back, closing[place] @ adopted.to_scene),
                np.einsum("vab,kvb->kva", back, basis[:, place] @ adopted.to_scene),
                np.einsum(
                    "vba,kvb->kva",
                    part.origin.linear / size[:, None, None],
                    turns[:, place].astype(np.float64) @ (adopted.to_scene / unit),
                ),
            )
        )
    return moves


def _back(part: MeshPart, origin: PartOrigin, name: str) -> tuple[Float64Array, Float64Array]:
    """(vertex, 3, 3) from the scene to the primitive's own space, and (vertex,) its scale."""
    size = np.cbrt(np.abs(np.linalg.det(origin.linear)))
    if not size.min() > FLAT:
        raise HeadError.about(
            name, found=f"{part.name!r} scaled to nothing", allowed="meshes with a volume"
        )
    return np.linalg.inv(origin.linear).astype(np.float64), size


def _check_mesh(document: GltfDocument, number: int, name: str) -> None:
    mesh = document.records("meshes")[number]
    subject = f"mesh {mesh.get('name', number)!r}"[:80]
    if any(primitive.get("targets") for primitive in mesh["primitives"]):
        raise HeadError.about(
            name,
            found=f"{subject} with morph targets",
            allowed="meshes without",
            remedy="export it without shape keys, or rename them as ARKit does",
        )
    if sum(node.get("mesh") == number for node in document.records("nodes")) > 1:
        raise HeadError.about(
            name,
            found=f"{subject} in several places",
            allowed="a mesh for each",
            remedy="make instances single",
        )


def _with_shapes(
    text: str,
    document: GltfDocument,
    added: GltfAdditions,
    arrays: GltfArrays,
    number: int,
    moves: dict[int, _Move],
) -> str:
    """The text with a mesh's morph targets, their names and weights."""
    mesh = document.records("meshes")[number]
    for place, primitive in enumerate(mesh["primitives"]):
        at: list[str | int] = ["meshes", number, "primitives", place]
        attributes = primitive["attributes"]
        if "POSITION" not in attributes:
            continue
        move = moves.get(place)
        if move is not None and move.closing.any():
            points = arrays.values(attributes["POSITION"]).astype(np.float32)
            points[move.origin.rows] += move.closing.astype(np.float32)
            position = added.accessor(points, "VEC3", bounds=True)
            text = with_value(text, [*at, "attributes", "POSITION"], position)
        text = with_value(text, [*at, "targets"], _targets(document, added, attributes, move))
    extras = mesh.get("extras")
    named = dict(extras) if isinstance(extras, dict) else {}
    text = with_value(text, ["meshes", number, "weights"], [0] * len(ARKIT_NAMES))
    named["targetNames"] = list(ARKIT_NAMES)
    return with_value(text, ["meshes", number, "extras"], named)


def _targets(
    document: GltfDocument, added: GltfAdditions, attributes: dict[str, int], move: _Move | None
) -> list[dict[str, Any]]:
    """The 52 morph targets of a primitive."""
    count = document.records("accessors")[attributes["POSITION"]]["count"]
    none = np.zeros(0, np.int64), np.zeros((0, 3), np.float32)
    targets = []
    for shape in range(len(ARKIT_NAMES)):
        moved = none if move is None else _moved(move.origin.rows, move.shapes[shape])
        target = {"POSITION": added.sparse(*moved, count, bounds=True)}
        if "NORMAL" in attributes:
            turned = none if move is None else _moved(move.origin.rows, move.turns[shape])
            target["NORMAL"] = added.sparse(*turned, count, bounds=False)
        targets.append(target)
    return targets


def _moved(
    rows: NDArray[np.int64], deltas: Float64Array
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """The vertices that are not still, and what becomes of them."""
    moved = deltas.any(axis=1)
    return rows[moved], deltas[moved].astype(np.float32)
