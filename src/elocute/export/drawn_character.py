"""Turns a character in its own file into a head that is drawn, and what its file would move into a
motion of that.

    the file → meshes at rest, morph targets, materials and joints
      → in the built-in head's size and place, by eyes and chin; the bust alone
      → a HeadModel and a Motion, which pictures and pages take as any other

Weights and turns are those of `character_weights`, which the writers of its file write.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array, Float64Array, IntArray
from elocute.errors import ElocuteError, ElocuteWarning, HeadError
from elocute.export.character_face import FacePlace, face_place
from elocute.export.character_surfaces import CharacterSurfaces, places_of
from elocute.export.character_weights import CharacterMotion, bare_parts, character_motion
from elocute.head.builtin import load_builtin_head
from elocute.head.character import Character
from elocute.head.mesh import head_from_arrays
from elocute.head.model import HeadModel
from elocute.meshes.gltf_arrays import GltfArrays, TooMuchError
from elocute.meshes.gltf_materials import Texture
from elocute.meshes.gltf_nodes import NodeTree, rest_turn, without_matrix
from elocute.meshes.mesh_file import MeshPart, PartOrigin
from elocute.meshes.parts import document_arrays
from elocute.motion.motion import Motion
from elocute.numerics.input_checks import NUMBERS_MAX
from elocute.numerics.quaternions import multiply, no_turn
from elocute.render.shading import to_srgb

NAME = "own/"
"""Begins the names of materials: what a stranger calls `hair` is no hair of ours."""
CROWN, BROAD = 2.4, 2.0
"""How far above the eyes, and how broad, a head is framed at most, in lengths from eyes to chin:
without the ears of a hare."""
BELOW, BESIDE, AROUND = 2.8, 3.4, 6.0
"""How far below the chin and to the sides what is drawn begins, and how far above and behind, in
lengths from eyes to chin: pictures show no more."""
WIDE_FROM = 1.6
"""Pictures that are wider than this, by their height, show more at the sides."""
MOUTH = 0.58
"""How far below the eyes a mouth is, as a share of the way to the chin."""


def drawn(motion: Motion, aspect: float = 1.0) -> Motion:
    """The motion of the head as pictures show it: in its look, or the character that it stands for.

    aspect: width by height of a picture. Warns of pictures in a character's file that are not
    read. Raises HeadError for a file whose meshes or pictures are damaged or too large, or packed
    by what is not installed.
    """
    if motion.head.character is None:
        return motion.dressed()
    return _drawn(motion, max(1.0, aspect / WIDE_FROM))


@lru_cache(maxsize=1)
def _drawn(motion: Motion, wider: float) -> Motion:
    """Kept for the next picture of the same take."""
    character = motion.head.character
    assert character is not None
    with _errors_of(character):
        return _assembled(motion, character, wider)


@contextlib.contextmanager
def _errors_of(character: Character) -> Iterator[None]:
    """What its records may hold where glTF wants something else is an error of one line."""
    try:
        with np.errstate(all="ignore"):
            yield
    except (ElocuteError, MemoryError):
        raise
    except TooMuchError as problem:
        found = "meshes that take more memory than its size allows"
        raise HeadError.about(character.name, found=found, allowed="a smaller file") from problem
    except Exception as problem:
        found, allowed = "no mesh that can be drawn", "meshes as glTF has them"
        raise HeadError.about(character.name, found=found, allowed=allowed) from problem


def placement(character: Character) -> Float64Array:
    """(4, 4) from a character's scene to where it is drawn, m. Raises as `drawn`."""
    with _errors_of(character):
        joints = _Joints(character, NodeTree(character.document))
        _, placed = _pieces(character, joints, _arrays_of(character))
    matrix = np.eye(4)
    matrix[:3, :3] = placed.scale * character.axes.T
    matrix[:3, 3] = placed(np.zeros(3))
    return matrix


def _arrays_of(character: Character) -> GltfArrays:
    return document_arrays(character.document, Path(character.name), HeadError)


def _pieces(
    character: Character, joints: _Joints, arrays: GltfArrays
) -> tuple[list[_Piece], _Placed]:
    """All primitives at rest, and the place of the face among them."""
    pieces = [
        _Piece(part, at, part.vertices @ character.axes, joints.weights(at, arrays))
        for part in bare_parts(character, arrays)
        if (at := part.origin) is not None
    ]
    points = np.concatenate([piece.points for piece in pieces])
    if not 1e-6 < np.ptp(points[:, 1]) < 1e9:
        raise HeadError.about(character.name, found="meshes of no size", allowed="a mesh of a face")
    skull = joints.skull(np.concatenate([piece.weights for piece in pieces]))
    return pieces, _Placed(face_place(character, joints.tree, points, skull))


def _assembled(motion: Motion, character: Character, wider: float) -> Motion:
    arrays = _arrays_of(character)
    joints = _Joints(character, NodeTree(character.document))
    pieces, placed = _pieces(character, joints, arrays)
    near = (piece.within(placed.face, wider) for piece in pieces)
    pieces = [piece for piece in near if piece is not None]
    if not pieces:
        raise HeadError.about(character.name, found="no mesh near its face", allowed="a head")
    played = character_motion(motion, character)
    shapes = _Shapes(character, played, pieces, motion.frame_count)
    basis, rest = shapes.deltas(arrays, character.axes)
    points = np.concatenate([piece.points for piece in pieces]) + rest
    mesh = _Mesh(placed(points), placed.scale * basis, shapes.names)
    head = _head(character, pieces, mesh, arrays)
    weights = head.skin_weights.astype(np.float64)
    regions = _regions(head.template.astype(np.float64), joints.skull(weights), placed)
    head = replace(
        head,
        joint_names=joints.names,
        joint_parents=joints.parents,
        joint_positions=placed(joints.places()).astype(np.float32),
        regions=regions,
        lip_rings=regions["mouth"][None],
    )
    return Motion(head, shapes.weights, motion.fps, joints.rotations(character, played, motion))


@dataclass(frozen=True, eq=False)
class _Placed:
    """From a character's own place and size to those of the built-in head."""

    face: FacePlace

    @property
    def eyes(self) -> Float64Array:
        """(3,) m, between the built-in head's."""
        builtin = load_builtin_head()
        return builtin.template[builtin.landmarks[36:48]].mean(axis=0) * np.array([0, 1, 1.0])

    @property
    def high(self) -> float:
        """From the built-in head's chin to its eyes, m."""
        builtin = load_builtin_head()
        return float(self.eyes[1] - builtin.template[builtin.landmarks[8], 1])

    @property
    def scale(self) -> float:
        return self.high / self.face.high

    def __call__(self, points: Float64Array) -> Float64Array:
        return self.scale * (points - self.face.eyes) + self.eyes


@dataclass(frozen=True, eq=False)
class _Piece:
    """A primitive, in the axes of heads."""

    part: MeshPart
    origin: PartOrigin
    points: Float64Array  # (vertex, 3) in the file's unit
    weights: Float64Array  # (vertex, joint)

    def within(self, face: FacePlace, wider: float) -> _Piece | None:
        """What of it pictures may show; None where that is nothing."""
        away = (self.points - face.eyes) / face.high
        near = (np.abs(away[:, 0]) < BESIDE * wider) & (away[:, 1] > -1 - BELOW)
        near &= (away[:, 1] < AROUND) & (np.abs(away[:, 2]) < AROUND)
        triangles = self.part.triangles[near[self.part.triangles].all(axis=1)]
        used, corners = np.unique(triangles, return_inverse=True)
        if not len(used):
            return None
        corners = corners.reshape(-1, 3)
        origin = replace(self.origin, rows=self.origin.rows[used], linear=self.origin.linear[used])
        if np.linalg.det(origin.linear[:: max(1, len(used) // 100)]).mean() < 0:
            corners = corners[:, ::-1]  # mirrored: what was the outside is the inside
        part = replace(self.part, triangles=corners)
        return _Piece(part, origin, self.points[used], self.weights[used])


class _Joints:
    """The joints that a character turns, below one that stays."""

    def __init__(self, character: Character, tree: NodeTree) -> None:
        self._character, self.tree = character, tree
        turned = {turn.node for turn in character.turns}
        self.nodes = sorted(turned, key=lambda node: len(tree.line(node)))
        self._of_node: dict[int, int] = {}
        self._document = character.document
        names = {turn.node: turn.joints[-1] for turn in character.turns}
        self.names = ("body", *_unlike([names[node] for node in self.nodes]))
        above = [self._of(tree.parents[node]) for node in self.nodes]
        self.parents = (-1, *above)
        self._known: dict[int, IntArray] = {}

    def _of(self, node: int) -> int:
        """The joint that a node hangs from."""
        for each in self.tree.line(node) if node >= 0 else ():
            if each in self.nodes:
                return 1 + self.nodes.index(each)
        return 0

    def places(self) -> Float64Array:
        """(joint, 3) in the axes of heads and the file's unit."""
        worlds = [np.eye(4), *(self.tree.world(node) for node in self.nodes)]
        return np.stack([world[:3, 3] for world in worlds]) @ self._character.axes

    def weights(self, origin: PartOrigin, arrays: GltfArrays) -> Float64Array:
        """(vertex, joint) how much of each vertex hangs from which."""
        node = self.tree.nodes[origin.node]
        mesh = self._document.records("meshes")[origin.mesh]
        attributes = mesh["primitives"][origin.primitive]["attributes"]
        total = np.zeros((len(origin.rows), len(self.names)))
        rigid = self._of(origin.node)
        if "skin" not in node or "JOINTS_0" not in attributes or len(self.names) == 1:
            total[:, rigid] = 1
            return total
        groups = self._groups(node["skin"])
        rows = np.arange(len(total))
        for number in range(2):
            if f"JOINTS_{number}" in attributes:
                joints = arrays.values(attributes[f"JOINTS_{number}"])[origin.rows].astype(np.int64)
                shares = arrays.values(attributes[f"WEIGHTS_{number}"])[origin.rows]
                for joint, share in zip(joints.T, shares.T, strict=True):
                    total[rows, groups[joint]] += share
        sums = total.sum(axis=1)
        total[sums <= 1e-6, rigid] = 1
        return total / total.sum(axis=1, keepdims=True)

    def _groups(self, skin: int) -> IntArray:
        """(joint of the skin,) which of our joints each hangs from."""
        if skin not in self._known:
            joints = self._document.records("skins")[skin]["joints"]
            self._known[skin] = np.array([self._of(joint) for joint in joints])
        return self._known[skin]

    def skull(self, weights: Float64Array) -> NDArray[np.bool_]:
        """(vertex,) which hang from the head, or from the neck of one that has no head's joint."""
        for name in ("head", "neck"):
            above = [i for i, each in enumerate(self.names) if each == name]
            if above:
                below = [i for i in range(len(self.names)) if set(above) & set(self._line(i))]
                return weights[:, below].sum(axis=1) > 0.5
        return np.zeros(len(weights), bool)

    def _line(self, joint: int) -> list[int]:
        line = [joint]
        while self.parents[line[-1]] >= 0:
            line.append(self.parents[line[-1]])
        return line

    def rotations(
        self, character: Character, played: CharacterMotion, motion: Motion
    ) -> Float32Array | None:
        """(frame, joint, 4) turns in the axes of heads; None where nothing turns."""
        if not played.turns:
            return None
        turns = no_turn(motion.frame_count, len(self.names)).astype(np.float64)
        for joint, node in enumerate(self.nodes, 1):
            record, axes = without_matrix(self.tree.nodes[node]), self.tree.axes(node)
            if node not in played.turns or record is None or axes is None:
                continue
            own = played.turns[node][:, [3, 0, 1, 2]].astype(np.float64)
            turned = multiply(own, rest_turn(record) * [1, -1, -1, -1])
            # The way back of `character_weights`, to the axes of heads.
            turned[:, 1:] = np.linalg.det(axes) * turned[:, 1:] @ axes.T @ character.axes
            turns[:, joint] = turned
        return turns.astype(np.float32)


class _Shapes:
    """The morph targets that a motion moves, those that move alike together."""

    def __init__(
        self,
        character: Character,
        played: CharacterMotion,
        pieces: Sequence[_Piece],
        frames: int,
    ) -> None:
        self._meshes = character.document.records("meshes")
        nodes = character.document.records("nodes")
        bound = {bind[:2]: control.name for control in character.controls for bind in control.binds}
        self._uses: dict[int, list[tuple[int, int | None, float]]] = {}
        names: list[str] = []
        columns: dict[bytes, int] = {}
        tables: list[Float32Array] = []
        for piece in pieces:
            node, mesh = piece.origin.node, piece.origin.mesh
            if node in self._uses:
                continue
            self._uses[node] = []
            rest = nodes[node].get("weights", self._meshes[mesh].get("weights", []))
            table = played.weights.get(node, np.array([rest], np.float32))
            for target, column in enumerate(table.T):
                if np.ptp(column) == 0:
                    if column[0]:
                        self._uses[node].append((target, None, float(column[0])))
                    continue
                key = column.tobytes()
                if key not in columns:
                    columns[key] = len(columns)
                    tables.append(column)
                    names.append(bound.get((mesh, target), f"shape {target}"))
                self._uses[node].append((target, columns[key], 1.0))
        self.names = _unlike([name[:150] for name in names])
        self.weights = np.stack(tables, axis=1) if tables else np.zeros((frames, 0), np.float32)
        self._pieces = pieces
        count = sum(len(piece.points) for piece in pieces)
        if 3 * count * (len(names) + 1) > NUMBERS_MAX:
            found = f"{count} vertices near its face with {len(names)} shapes"
            allowed = f"up to {NUMBERS_MAX // 3} in all"
            raise HeadError.about(character.name, found=found, allowed=allowed)

    def deltas(self, arrays: GltfArrays, axes: Float64Array) -> tuple[Float32Array, Float64Array]:
        """(shape, vertex, 3) of all pieces, and (vertex, 3) of shapes that stay, in the file's
        unit."""
        ends = np.cumsum([0, *(len(piece.points) for piece in self._pieces)])
        basis = np.zeros((len(self.names), ends[-1], 3), np.float32)
        rest = np.zeros((ends[-1], 3))
        for piece, start in zip(self._pieces, ends, strict=False):
            origin = piece.origin
            primitive = self._meshes[origin.mesh]["primitives"][origin.primitive]
            targets, rows = primitive.get("targets", []), slice(start, start + len(piece.points))
            for target, shape, weight in self._uses[origin.node]:
                if not targets or "POSITION" not in targets[target]:
                    continue
                moves = arrays.values(targets[target]["POSITION"])[origin.rows, :3]
                moves = np.einsum("vab,vb->va", origin.linear, moves) @ axes
                if shape is None:
                    rest[rows] += weight * moves
                else:
                    basis[shape, rows] += moves
        return basis, rest


@dataclass(frozen=True, eq=False)
class _Mesh:
    """Vertices of all pieces in the built-in head's place, and how shapes move them."""

    points: Float64Array  # (vertex, 3) m
    basis: Float32Array  # (shape, vertex, 3) m
    names: tuple[str, ...]  # of the shapes


def _head(
    character: Character, pieces: Sequence[_Piece], mesh: _Mesh, arrays: GltfArrays
) -> HeadModel:
    """The pieces as one mesh with their materials; joints and regions are still to come."""
    surfaces = CharacterSurfaces(character.name, character.document, arrays)
    sizes = [len(piece.points) for piece in pieces]
    starts = np.cumsum([0, *sizes])[:-1]
    numbers = [_primitive(character, piece).get("material") for piece in pieces]
    used = list(dict.fromkeys(numbers))
    materials = [surfaces.materials[number] for number in used]
    names = _unlike([f"{NAME}{each.name}" for each in materials])
    uv, colors, normals = (
        np.concatenate(each)
        for each in zip(
            *(
                _attributes(character, piece, surfaces.places(surfaces.materials[number]), arrays)
                for piece, number in zip(pieces, numbers, strict=True)
            ),
            strict=True,
        )
    )
    weights = np.concatenate([piece.weights for piece in pieces])
    joints = weights.shape[1]
    first, place = _joined(mesh, normals, colors, weights)
    triangles = np.concatenate(
        [piece.part.triangles + start for piece, start in zip(pieces, starts, strict=True)]
    )
    counts = [len(piece.part.triangles) for piece in pieces]
    head = head_from_arrays(
        character.name,
        mesh.points[first],
        place[triangles],
        expression_names=mesh.names,
        expression_basis=mesh.basis[:, first],
    )
    head = replace(
        head,
        uv=uv.astype(np.float32),
        uv_quads=np.concatenate([triangles, triangles[:, 2:]], axis=1).astype(np.int32),
        material=np.repeat([used.index(number) for number in numbers], counts).astype(np.uint8),
        material_names=names,
        vertex_color=colors[first],
        surfaces={
            name: surfaces.surface(each) for name, each in zip(names, materials, strict=True)
        },
        # Which joints these are is said later.
        joint_names=tuple(map(str, range(joints))),
        joint_parents=(-1,) * joints,
        joint_positions=np.zeros((joints, 3), np.float32),
        joint_identity_basis=np.zeros((0, joints, 3), np.float32),
        skin_weights=weights[first].astype(np.float32),
    )
    if surfaces.told:
        warnings.warn(
            f"{character.name}: {', '.join(surfaces.told)}: left out of its look",
            ElocuteWarning,
            stacklevel=2,
        )
    return head


def _primitive(character: Character, piece: _Piece) -> dict[str, Any]:
    mesh = character.document.records("meshes")[piece.origin.mesh]
    return mesh["primitives"][piece.origin.primitive]


def _attributes(
    character: Character, piece: _Piece, texture: Texture | None, arrays: GltfArrays
) -> tuple[Float64Array, NDArray[np.uint8], Float64Array]:
    """Places in pictures (vertex, 2), sRGB (vertex, 3) and normals (vertex, 3) of a piece; where
    it has none, zeros, white and zeros."""
    attributes, rows = _primitive(character, piece)["attributes"], piece.origin.rows
    uv = places_of(arrays, attributes, texture)
    colors = np.full((len(rows), 3), 255, np.uint8)
    if "COLOR_0" in attributes:
        shares = arrays.values(attributes["COLOR_0"])[rows, :3]
        if shares.dtype.kind != "f":  # of writers that forget to call them normalized
            shares = shares / float(np.iinfo(shares.dtype).max)
        srgb = to_srgb(np.clip(np.nan_to_num(shares), 0, 1).astype(np.float32))
        colors = np.round(255 * srgb).astype(np.uint8)
    normals = np.zeros((len(rows), 3))
    if "NORMAL" in attributes:
        normals = np.nan_to_num(arrays.values(attributes["NORMAL"])[rows, :3].astype(np.float64))
    return np.zeros((len(rows), 2)) if uv is None else uv[rows], colors, normals


def _joined(
    mesh: _Mesh, normals: Float64Array, colors: NDArray[np.uint8], weights: Float64Array
) -> tuple[IntArray, IntArray]:
    """Vertices that only a seam of pictures parts made one: a vertex (joined,) for each that is
    left, and which each became (vertex,).

    Edges that are meant, and lips that touch, have normals of their own or move apart.
    """
    ways = np.random.default_rng(0).normal(size=(len(mesh.basis), 3)).astype(np.float32)
    moves = np.einsum("svc,sc->v", mesh.basis, ways, optimize=True)
    keys = [mesh.points * 1e6, np.round(normals * 50), colors, moves[:, None] * 1e6, weights * 100]
    table = np.ascontiguousarray(np.concatenate(keys, axis=1).round().astype(np.int64))
    rows = table.view(np.dtype((np.void, table.itemsize * table.shape[1]))).ravel()
    _, first, place = np.unique(rows, return_index=True, return_inverse=True)
    return first, place.ravel()


def _regions(
    points: Float64Array, skull: NDArray[np.bool_], placed: _Placed
) -> dict[str, NDArray[np.int32]]:
    """What pictures are framed by, of vertices (vertex, 3) m; skull: which hang from the head."""
    away = (points - placed.eyes) / placed.high
    round_it = (away[:, 1] < CROWN) & (np.abs(away[:, 0]) < BROAD)
    round_it &= np.abs(away[:, 2]) < BROAD
    framed = round_it & ((away[:, 1] > -1) | (skull if skull.any() else False))
    framed |= ~framed.any()  # where nothing is where a head should be, all of it
    ahead = away[framed & (np.abs(away[:, 0]) < 0.6), 2].max(initial=-9)
    regions = {
        "framed": np.flatnonzero(framed),
        "skin": np.flatnonzero((framed | round_it) & (away[:, 1] > -2) & (away[:, 2] <= ahead)),
        "eyes": [np.square(away[:, 1:]).sum(axis=1).argmin()],
        "chin": [np.square(away - [0, -1, 0.5]).sum(axis=1).argmin()],
        "mouth": [np.square(away - [0, -MOUTH, ahead]).sum(axis=1).argmin()],
    }
    return {name: np.array(each, np.int32) for name, each in regions.items()}


def _unlike(names: Sequence[str]) -> tuple[str, ...]:
    """Names of which no two are the same."""
    found: dict[str, None] = {}
    for name in names:
        number, unlike = 1, name
        while unlike in found:
            number += 1
            unlike = f"{name} {number}"
        found[unlike] = None
    return tuple(found)
