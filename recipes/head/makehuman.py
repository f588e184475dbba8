"""Read MakeHuman's CC0 data: base mesh, morph targets, rig, fitted eyes. Metres throughout."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

METRES = 0.1
"""MakeHuman models in decimetres."""


@dataclass(frozen=True, eq=False)
class Mesh:
    vertices: np.ndarray  # (vertex, 3) m
    quads: np.ndarray  # (face, 4)
    uv: np.ndarray  # (texcoord, 2)
    uv_quads: np.ndarray  # (face, 4)
    groups: np.ndarray  # (face,) name of each face's group


@dataclass(frozen=True, eq=False)
class MakeHuman:
    """The data folder, files read when first asked for."""

    folder: Path

    @cached_property
    def base(self) -> Mesh:
        return read_obj(self.folder / "3dobjs" / "base.obj")

    @cached_property
    def bones(self) -> dict[str, dict]:
        return self._skeleton["bones"]

    @cached_property
    def _skeleton(self) -> dict:
        return json.loads((self.folder / "rigs" / "default.mhskel").read_text())

    @cached_property
    def _targets(self) -> dict[str, np.ndarray]:
        return {}

    @cached_property
    def bone_weights(self) -> dict[str, np.ndarray]:
        """Bone -> (vertex,) weight; they sum to one where any is set."""
        table = json.loads((self.folder / "rigs" / "default_weights.mhw").read_text())["weights"]
        weights = {}
        for bone, pairs in table.items():
            dense = np.zeros(len(self.base.vertices))
            for vertex, weight in pairs:
                dense[vertex] += weight
            weights[bone] = dense
        total = np.maximum(sum(weights.values()), 1e-9)
        return {bone: dense / total for bone, dense in weights.items()}

    def joint(self, name: str, vertices: np.ndarray) -> np.ndarray:
        """(3,) m: a joint is the centre of a little cube of helper vertices."""
        return vertices[self._skeleton["joints"][name]].mean(0)

    def ancestors(self, bone: str) -> list[str]:
        """The bone, its parent, and so on to the root."""
        chain = []
        while bone:
            chain.append(bone)
            bone = self.bones[bone]["parent"]
        return chain

    def target(self, name: str) -> np.ndarray:
        """(vertex, 3) m displacement of one morph target, `folder/name` without suffix."""
        if name not in self._targets:
            text = (self.folder / "targets" / f"{name}.target").read_text().splitlines()
            rows = [line.split() for line in text if line.strip() and line[0] != "#"]
            delta = np.zeros_like(self.base.vertices)
            if rows:
                table = np.array([row[:4] for row in rows], float)
                delta[table[:, 0].astype(int)] = table[:, 1:] * METRES
            self._targets[name] = delta
        return self._targets[name]

    def target_names(self, folder: str) -> list[str]:
        paths = (self.folder / "targets" / folder).glob("*.target")
        return sorted(path.stem for path in paths)

    def eye_mesh(self, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (m) and quads of the high-poly eyes fitted to a body."""
        fit = read_clothing(self.folder / "eyes" / "high-poly" / "high-poly.mhclo")
        quads = read_obj(self.folder / "eyes" / "high-poly" / "high-poly.obj").quads
        return fit.fitted(vertices), quads


@dataclass(frozen=True, eq=False)
class Clothing:
    """A mesh that follows the body: weighted body triangles plus scaled offsets."""

    triangles: np.ndarray  # (vertex, 3) body vertices
    weights: np.ndarray  # (vertex, 3)
    offsets: np.ndarray  # (vertex, 3)
    scales: tuple[tuple[int, int, float], ...]  # per axis: two body vertices, their distance

    def fitted(self, body: np.ndarray) -> np.ndarray:
        placed = (body[self.triangles] * self.weights[:, :, None]).sum(1)
        for axis, (first, second, distance) in enumerate(self.scales):
            scale = abs(body[first, axis] - body[second, axis]) / distance
            placed[:, axis] += self.offsets[:, axis] * scale
        return placed


def read_obj(path: Path) -> Mesh:
    """A Wavefront file of quads (a triangle repeats its last corner)."""
    vertices, uv, quads, uv_quads, groups = [], [], [], [], []
    group = ""
    for line in path.read_text().splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            vertices.append(words[:3])
        elif kind == "vt":
            uv.append(words[:2])
        elif kind == "g":
            group = words[0]
        elif kind == "f":
            corners = [word.split("/") for word in words]
            corners += [corners[-1]] * (4 - len(corners))
            quads.append([int(corner[0]) - 1 for corner in corners])
            uv_quads.append([int(corner[1]) - 1 for corner in corners])
            groups.append(group)
    return Mesh(
        np.array(vertices, float) * METRES,
        np.array(quads),
        np.array(uv, float),
        np.array(uv_quads),
        np.array(groups),
    )


def read_clothing(path: Path) -> Clothing:
    rows, scales, in_vertices = [], {}, False
    for line in path.read_text().splitlines():
        words = line.split()
        if not words or words[0] == "#":
            continue
        if words[0].endswith("_scale"):
            scales[words[0][0]] = (int(words[1]), int(words[2]), float(words[3]))
        elif words[0] == "verts":
            in_vertices = True
        elif in_vertices and words[0].isdigit():
            if len(words) >= 9:
                rows.append([float(word) for word in words[:9]])
            else:
                rows.append([*[float(words[0])] * 3, 1, 0, 0, 0, 0, 0])
    table = np.array(rows)
    return Clothing(
        table[:, :3].astype(int),
        table[:, 3:6],
        table[:, 6:],
        tuple(scales[axis] for axis in "xyz"),
    )
