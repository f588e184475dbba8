"""MakeHuman's face pose units: bone rotations, turned into vertex displacements."""

from __future__ import annotations

import json
from functools import cached_property

import numpy as np

from recipes.head.makehuman import MakeHuman

Z_UP_TO_Y_UP = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)


def axis_rotation(axis: str, degrees: float) -> np.ndarray:
    angle = np.radians(degrees)
    c, s = np.cos(angle), np.sin(angle)
    rows = {
        "X": [[1, 0, 0], [0, c, -s], [0, s, c]],
        "Y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
        "Z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
    }
    return np.array(rows[axis])


class PoseUnits:
    """Named pose units, each one frame of a BVH file."""

    def __init__(self, mh: MakeHuman) -> None:
        self.mh = mh
        folder = mh.folder / "poseunits"
        mapping = json.loads((folder / "face-poseunits.json").read_text())["framemapping"]
        self.frames = {name: frame for frame, name in enumerate(mapping)}
        self._channels, self._motion = _read_bvh((folder / "face-poseunits.bvh").read_text())

    @cached_property
    def _weights(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        return {
            bone: (np.flatnonzero(weight), weight[weight > 0])
            for bone, weight in self.mh.bone_weights.items()
        }

    def delta(self, name: str, body: np.ndarray) -> np.ndarray:
        """(vertex, 3) m displacement of `body` under one pose unit."""
        return self._posed(self.frames[name], body) - self._posed(0, body)

    def _rotations(self, frame: int) -> dict[str, np.ndarray]:
        values = iter(self._motion[frame])
        rotations = {}
        for joint, channels in self._channels:
            turn = np.eye(3)
            for channel in channels:
                value = next(values)
                if channel.endswith("rotation"):
                    turn = turn @ axis_rotation(channel[0], value)
            rotations[joint] = Z_UP_TO_Y_UP @ turn @ Z_UP_TO_Y_UP.T
        return rotations

    def _posed(self, frame: int, body: np.ndarray) -> np.ndarray:
        """Linear blend skinning down the bone tree, rotations along the world's axes."""
        rotations = self._rotations(frame)
        world: dict[str, np.ndarray] = {}

        def transform(bone: str) -> np.ndarray:
            if bone not in world:
                pivot = self.mh.joint(self.mh.bones[bone]["head"], body)
                turn = rotations.get(bone, np.eye(3))
                local = np.eye(4)
                local[:3, :3], local[:3, 3] = turn, pivot - turn @ pivot
                parent = self.mh.bones[bone]["parent"]
                world[bone] = transform(parent) @ local if parent else local
            return world[bone]

        posed = np.zeros_like(body)
        covered = np.zeros(len(body))
        for bone, (vertices, weights) in self._weights.items():
            matrix = transform(bone)
            moved = body[vertices] @ matrix[:3, :3].T + matrix[:3, 3]
            posed[vertices] += weights[:, None] * moved
            covered[vertices] += weights
        bare = covered < 1e-6
        posed[bare] = body[bare]
        return posed


def _read_bvh(text: str) -> tuple[list[tuple[str, list[str]]], np.ndarray]:
    channels, joint = [], ""
    lines = iter(text.splitlines())
    for line in lines:
        words = line.split()
        if not words:
            continue
        if words[0] in ("ROOT", "JOINT"):
            joint = words[1]
        elif words[0] == "CHANNELS":
            channels.append((joint, words[2:]))
        elif words[0] == "MOTION":
            break
    rows = [line.split() for line in lines]
    motion = [row for row in rows if row and not row[0].startswith("Frame")]
    return channels, np.array(motion, float)
