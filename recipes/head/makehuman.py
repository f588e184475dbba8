"""Reading MakeHuman's CC0 data: base mesh, targets, rig, pose units, eyes. Lengths: decimetres."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

RACES = ("african", "asian", "caucasian")
VERTICES = 19158


@dataclass(frozen=True)
class BaseMesh:
    vertices: np.ndarray
    quads: np.ndarray
    groups: np.ndarray
    uv: np.ndarray
    uv_quads: np.ndarray

    def group(self, *names: str) -> np.ndarray:
        """(face, 4) of the groups so called."""
        return self.quads[np.isin(self.groups, names)]


class MakeHuman:
    """The data folder `makehuman/`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @cached_property
    def base(self) -> BaseMesh:
        vertices, quads, groups, uv, uv_quads, group = [], [], [], [], [], ""
        for line in (self.folder / "3dobjs/base.obj").read_text().splitlines():
            parts = line.split()
            if not parts:
                continue
            if parts[0] == "v":
                vertices.append([float(x) for x in parts[1:4]])
            elif parts[0] == "vt":
                uv.append([float(x) for x in parts[1:3]])
            elif parts[0] == "g":
                group = parts[1]
            elif parts[0] == "f":
                corners = [corner.split("/") for corner in parts[1:]]
                quads.append([int(corner[0]) - 1 for corner in corners])
                uv_quads.append([int(corner[1]) - 1 for corner in corners])
                groups.append(group)
        return BaseMesh(*map(np.array, (vertices, quads, groups, uv, uv_quads)))

    @lru_cache(maxsize=None)  # noqa: B019  one instance per run
    def target(self, name: str) -> np.ndarray:
        """(vertex, 3) displacement of one morph target."""
        result = np.zeros((VERTICES, 3), np.float32)
        for line in (self.folder / "targets" / f"{name}.target").read_text().splitlines():
            parts = line.split()
            if parts and not parts[0].startswith("#"):
                result[int(parts[0])] = [float(x) for x in parts[1:4]]
        return result

    def expression(self, name: str) -> np.ndarray:
        """An expression unit, mean of the three ancestries."""
        return sum(self.target(f"expression/units/{race}/{name}") for race in RACES) / 3

    def macro(
        self, male: float, age: float, muscle: float, weight: float, ancestry: np.ndarray
    ) -> np.ndarray:
        """(vertex, 3) displacement of sex, age (0.5 young … 1 old), build and ancestry."""
        result = np.zeros((VERTICES, 3), np.float32)
        old = max(0.0, age * 2 - 1)
        muscles = _split(muscle, "maxmuscle", "minmuscle", "averagemuscle")
        weights = _split(weight, "maxweight", "minweight", "averageweight")
        for sex, a in (("male", male), ("female", 1 - male)):
            for years, b in (("young", 1 - old), ("old", old)):
                for race, c in zip(RACES, ancestry, strict=True):
                    if a * b * c:
                        result += a * b * c * self.target(f"macrodetails/{race}-{sex}-{years}")
                for m, c in muscles.items():
                    for w, d in weights.items():
                        if a * b * c * d:
                            name = f"macrodetails/universal-{sex}-{years}-{m}-{w}"
                            result += a * b * c * d * self.target(name)
        return result

    @cached_property
    def rig(self) -> dict:
        return json.loads((self.folder / "rigs/default.mhskel").read_text())

    @cached_property
    def skin(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Bone → (vertex indices, weights)."""
        weights = json.loads((self.folder / "rigs/default_weights.mhw").read_text())["weights"]
        return {
            bone: (np.array([i for i, _ in pairs], int), np.array([w for _, w in pairs]))
            for bone, pairs in weights.items()
        }

    def joint(self, name: str, vertices: np.ndarray) -> np.ndarray:
        """(3,) position of a rig joint on a body."""
        return vertices[self.rig["joints"][name]].mean(axis=0)

    def parents(self, bone: str) -> list[str]:
        """The bone and all above it."""
        chain = []
        while bone:
            chain.append(bone)
            bone = self.rig["bones"][bone]["parent"]
        return chain

    @cached_property
    def total_weight(self) -> np.ndarray:
        total = np.zeros(VERTICES)
        for indices, weights in self.skin.values():
            total[indices] += weights
        return total

    def weight_under(self, *roots: str) -> np.ndarray:
        """(vertex,) share of the bones `roots` and all below them."""
        result = np.zeros(VERTICES)
        for bone, (indices, weights) in self.skin.items():
            if set(self.parents(bone)) & set(roots):
                result[indices] += weights
        return np.clip(result / np.maximum(self.total_weight, 1e-9), 0, 1)

    @cached_property
    def pose_frames(self) -> tuple[list[str], list[dict[str, np.ndarray]]]:
        """Names of the pose units and, for each, bone → rotation matrix (Y up)."""
        names = json.loads((self.folder / "poseunits/face-poseunits.json").read_text())
        frames = _read_bvh(self.folder / "poseunits/face-poseunits.bvh")
        return names["framemapping"], frames

    def pose_unit(self, vertices: np.ndarray, name: str) -> np.ndarray:
        """(vertex, 3) displacement of a facial pose unit by forward kinematics."""
        names, frames = self.pose_frames
        return self._posed(vertices, frames[names.index(name)]) - self._posed(vertices, frames[0])

    def _posed(self, vertices: np.ndarray, turns: dict[str, np.ndarray]) -> np.ndarray:
        transforms: dict[str, np.ndarray] = {}

        def transform(bone: str) -> np.ndarray:
            if bone not in transforms:
                record = self.rig["bones"][bone]
                head = self.joint(record["head"], vertices)
                local = np.eye(4)
                local[:3, :3] = turns.get(bone, np.eye(3))
                local[:3, 3] = head - local[:3, :3] @ head
                above = transform(record["parent"]) if record["parent"] else np.eye(4)
                transforms[bone] = above @ local
            return transforms[bone]

        result = np.zeros_like(vertices)
        for bone, (indices, weights) in self.skin.items():
            matrix = transform(bone)
            moved = vertices[indices] @ matrix[:3, :3].T + matrix[:3, 3]
            result[indices] += weights[:, None] * moved
        held = self.total_weight > 1e-6
        result[held] /= self.total_weight[held, None]
        result[~held] = vertices[~held]
        return result

    @cached_property
    def _eye_fit(self) -> tuple[dict, np.ndarray]:
        scales, rows, inside = {}, [], False
        for line in (self.folder / "eyes/high-poly/high-poly.mhclo").read_text().splitlines():
            parts = line.split()
            if not parts or parts[0].startswith("#"):
                continue
            if parts[0] in ("x_scale", "y_scale", "z_scale"):
                scales["xyz".index(parts[0][0])] = (int(parts[1]), int(parts[2]), float(parts[3]))
            elif parts[0] == "verts":
                inside = True
            elif inside and len(parts) >= 9:
                rows.append([float(x) for x in parts[:9]])
        return scales, np.array(rows)

    def eye_balls(self, vertices: np.ndarray) -> list[tuple[np.ndarray, float]]:
        """Centre and radius of the left (+X) and the right eyeball on a body."""
        scales, rows = self._eye_fit
        offsets = rows[:, 6:9].copy()
        for axis, (a, b, size) in scales.items():
            offsets[:, axis] *= abs(vertices[a, axis] - vertices[b, axis]) / size
        points = (vertices[rows[:, :3].astype(int)] * rows[:, 3:6, None]).sum(axis=1) + offsets
        balls = []
        for side, joint in ((points[:, 0] > 0, "eye.L____head"), (points[:, 0] < 0, "eye.R____head")):
            centre = self.joint(joint, vertices)
            balls.append((centre, float(np.median(np.linalg.norm(points[side] - centre, axis=1)))))
        return balls


def _split(value: float, high: str, low: str, middle: str) -> dict[str, float]:
    up, down = max(0.0, value * 2 - 1), max(0.0, 1 - value * 2)
    return {high: up, low: down, middle: 1 - up - down}


def rotation(axis: str, degrees: float) -> np.ndarray:
    """(3, 3) turn about one axis."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return {
        "X": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
        "Y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
        "Z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
    }[axis]


def _read_bvh(path: Path) -> list[dict[str, np.ndarray]]:
    """Per frame, bone → rotation matrix, turned from Z up to Y up."""
    up = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)
    bone, channels, frames, moving = "", [], [], False
    for line in path.read_text().splitlines():
        parts = line.split()
        if not parts:
            continue
        if parts[0] in ("ROOT", "JOINT"):
            bone = parts[1]
        elif parts[0] == "CHANNELS":
            channels.append((bone, parts[2:]))
        elif parts[0] == "MOTION":
            moving = True
        elif moving and parts[0] not in ("Frames:", "Frame"):
            values, turns = iter(map(float, parts)), {}
            for name, kinds in channels:
                turn = np.eye(3)
                for kind in kinds:
                    value = next(values)
                    if kind.endswith("rotation"):
                        turn = turn @ rotation(kind[0], value)
                turns[name] = up @ turn @ up.T
            frames.append(turns)
    return frames
