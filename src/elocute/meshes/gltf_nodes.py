"""Finds where the nodes of a glTF file stand at rest, and their hierarchy."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.meshes.gltf_document import GltfDocument
from elocute.numerics.quaternions import from_matrices, to_matrices
from elocute.numerics.rigid_alignment import nearest_rotation

SHEAR = 1e-4
"""How far a matrix may be from a turn, a scale and a shift, relative to its scale."""


class NodeTree:
    """The nodes of a file, which form trees, at rest."""

    def __init__(self, document: GltfDocument) -> None:
        self.nodes = document.records("nodes")
        self.parents = [-1] * len(self.nodes)
        for number, node in enumerate(self.nodes):
            for child in node.get("children", []):
                self.parents[child] = number
        self._document = document
        self._worlds: dict[int, NDArray[np.float64]] = {-1: np.eye(4)}

    def name(self, node: int) -> str:
        """The name of a node; "" without one."""
        name = self.nodes[node].get("name")
        return name if isinstance(name, str) else ""

    def line(self, node: int) -> list[int]:
        """A node and all that it hangs from, the nearest first."""
        line = [node]
        while self.parents[line[-1]] >= 0:
            line.append(self.parents[line[-1]])
        return line

    def below(self, node: int) -> list[int]:
        """A node and all that hangs from it."""
        nodes, left = [], [node]
        while left:
            nodes.append(left.pop())
            left += self.nodes[nodes[-1]].get("children", [])
        return nodes

    def shown(self) -> list[int]:
        """The nodes of the scene that is shown, or all where there is none."""
        scenes = self._document.records("scenes")
        if not scenes:
            return list(range(len(self.nodes)))
        number = self._document.record.get("scene", 0)
        whole = isinstance(number, int) and 0 <= number < len(scenes)
        roots = scenes[number if whole else 0].get("nodes", [])
        return [node for root in roots for node in self.below(root)]

    def world(self, node: int) -> NDArray[np.float64]:
        """(4, 4) from a node's own space to the scene's, at rest; finite where the scales are."""
        unknown = []
        while node not in self._worlds:  # up to what is known: a chain is walked once
            unknown.append(node)
            node = self.parents[node]
        world = self._worlds[node]
        with np.errstate(all="ignore"):
            for each in reversed(unknown):
                world = self._worlds[each] = world @ local_matrix(self.nodes[each])
        return world

    def axes(self, node: int) -> NDArray[np.float64] | None:
        """(3, 3) axes in the scene of what a node hangs from, each of length one, at rest.

        Mirrored where the scene mirrors it; None where scales are zero or not finite.
        """
        parent = self.parents[node]
        linear = np.eye(3) if parent < 0 else self.world(parent)[:3, :3]
        if not np.isfinite(linear).all():
            return None
        size = np.abs(linear).max()
        if not 1e-12 < size < 1e12 or abs(np.linalg.det(linear / size)) < 1e-9:
            return None
        mirror = float(np.sign(np.linalg.det(linear / size)))
        return mirror * nearest_rotation(mirror * linear / size)[0]


def local_matrix(node: dict[str, Any]) -> NDArray[np.float64]:
    """(4, 4) of a node's record: from its own space to that of what it hangs from."""
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T  # columns first in the file
    matrix = np.eye(4)
    turn = to_matrices(rest_turn(node)).astype(np.float64)
    matrix[:3, :3] = turn * np.array(node.get("scale", [1, 1, 1]), float)
    matrix[:3, 3] = node.get("translation", [0, 0, 0])
    return matrix


def rest_turn(node: dict[str, Any]) -> NDArray[np.float64]:
    """(4,) unit quaternion wxyz of a node without a matrix."""
    x, y, z, w = np.array(node.get("rotation", [0, 0, 0, 1]), float)
    length = np.linalg.norm([w, x, y, z])
    if not 1e-12 < length < 1e12:
        return np.array([1.0, 0, 0, 0])
    return np.array([w, x, y, z]) / length


def without_matrix(node: dict[str, Any]) -> dict[str, Any] | None:
    """A node's record as a turn, a scale and a shift, which alone can be animated.

    The record itself where it has no matrix; None where its matrix shears.
    """
    if "matrix" not in node:
        return node
    matrix = local_matrix(node)
    with np.errstate(all="ignore"):
        linear = matrix[:3, :3]
        scale = np.linalg.norm(linear, axis=0) * [np.sign(np.linalg.det(linear)), 1, 1]
        turn = linear / scale
    last = np.abs(matrix[3] - [0, 0, 0, 1]).max()
    if not np.isfinite(turn).all() or np.abs(turn.T @ turn - np.eye(3)).max() > SHEAR or last > 0:
        return None
    quaternion = from_matrices(turn)
    rest = {name: value for name, value in node.items() if name != "matrix"}
    return rest | {
        "translation": matrix[:3, 3].tolist(),
        "rotation": quaternion[[1, 2, 3, 0]].tolist(),
        "scale": scale.tolist(),
    }
