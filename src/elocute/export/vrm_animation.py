"""VRM animation 1.0 (.vrma): a motion for any VRM, as expressions, turns of bones and a gaze.

The weight of an expression is the x of its node's translation; the gaze is the turn of a node,
yaw first, then pitch. There is no mesh.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.export.gltf import joint_nodes
from elocute.export.gltf_file import Channels, GltfFile, unit_xyzw
from elocute.export.options import VrmaOptions
from elocute.export.shape_profiles import Targets, target_shapes
from elocute.export.vrm import add_body, bone_joints, standing
from elocute.files.atomic import write_atomically
from elocute.head.gaze import gaze_reach
from elocute.head.preset_shapes import VRM_GAZE
from elocute.motion.motion import Motion
from elocute.numerics.quaternions import from_axis_angle, multiply

EXTENSION = "VRMC_vrm_animation"
TURNED = ("neck", "head")
STILL = 1e-6


def write_vrma(
    motion: Motion,
    path: str | Path,
    *,
    sound: object = None,
    options: VrmaOptions | None = None,
    progress: Any = None,
) -> None:
    """Write a motion as a VRM animation, which has no sound; it is written at once.

    Raises OutputError for a place that cannot be written, and a head without ARKit's shapes.
    """
    with write_atomically(path) as draft:
        draft.write_bytes(vrma_bytes(motion, options))


def vrma_bytes(motion: Motion, options: VrmaOptions | None = None) -> bytes:
    """A motion as the bytes of a .vrma, with vowels, lids and gaze or ARKit's 52 expressions.

    Raises OutputError for a head without ARKit's shapes.
    """
    perfect = options is not None and options.perfect_sync
    shapes = target_shapes(motion.head, "arkit" if perfect else "vrm")
    weights = dict(zip(shapes.names, shapes.weights(motion).T, strict=True))
    looks = {} if perfect else {name: weights.pop(name) for name in VRM_GAZE}
    if not perfect:
        weights = {name: row for name, row in weights.items() if _moves(name, row)}
    file = GltfFile()
    file.json["asset"]["extras"] = {"elocute": _record(motion, shapes, perfect)}
    scene = _Scene(file, motion)
    expressions = {name: scene.expression(name, row) for name, row in weights.items()}
    extension: dict[str, Any] = {
        "specVersion": "1.0",
        "humanoid": {"humanBones": scene.bones},
        "expressions": {"custom" if perfect else "preset": expressions},
    }
    if looks:
        extension["lookAt"] = {"node": scene.gaze(_gaze(motion, looks))}
    file.uses(EXTENSION)
    file.json["extensions"] = {EXTENSION: extension}
    scene.finish()
    return file.pack()


def _moves(name: str, weights: NDArray[np.float32]) -> bool:
    """Vowels and lids are always there; what else rests throughout is left to who plays it."""
    return name in MOVED or bool(np.abs(weights).max(initial=0) > STILL)


MOVED = ("aa", "ih", "ou", "ee", "oh", "blinkLeft", "blinkRight")


def _record(motion: Motion, shapes: Targets, perfect: bool) -> dict[str, Any]:
    """What was done to make the motion fit the format."""
    left = shapes.report(motion)
    record: dict[str, Any] = {"profile": "arkit" if perfect else "vrm", "fps": motion.fps}
    return record | ({"folded" if perfect else "fitted": left} if left else {})


def _gaze(motion: Motion, looks: dict[str, NDArray[np.float32]]) -> NDArray[np.float64]:
    """(frame, 4) wxyz: to its own left about +Y, then down about +X."""
    reach = gaze_reach(motion.head)
    yaw = reach["Out"] * (looks["lookLeft"] - looks["lookRight"])
    pitch = reach["Down"] * looks["lookDown"] - reach["Up"] * looks["lookUp"]
    still = np.zeros_like(yaw)
    about_y = from_axis_angle(np.radians(np.stack([still, yaw, still], axis=1)))
    about_x = from_axis_angle(np.radians(np.stack([pitch, still, still], axis=1)))
    return multiply(about_y, about_x)


class _Scene:
    """The nodes of a file, and the channels that move them."""

    def __init__(self, file: GltfFile, motion: Motion) -> None:
        self.file, self.motion = file, standing(motion)
        self.nodes: list[dict[str, Any]] = []
        self.roots: list[int] = []
        times = motion.times_s.astype(np.float32)
        self.speech = Channels(file.array(times, bounds=True))
        self.bones = self._bones()

    def _bones(self) -> dict[str, dict[str, int]]:
        """The nodes of the bones by name, neck and head turned; eyes have a gaze instead."""
        head = self.motion.head
        joints = bone_joints(head)
        joint_nodes(head, self.nodes)
        root, bones = add_body(head, self.nodes, first=0)
        self.roots.append(root)
        if self.motion.rotations is not None:
            for bone in TURNED:
                if bone in joints:
                    self._turn(bones[bone], self.motion.rotations[:, joints[bone]])
        return {bone: {"node": node} for bone, node in bones.items() if "Eye" not in bone}

    def expression(self, name: str, weights: NDArray[np.float32]) -> dict[str, int]:
        """A node whose x is a weight."""
        node = self._node(name)
        places = np.zeros((len(weights), 3), np.float32)
        places[:, 0] = np.clip(weights, 0, 1)
        self.speech.move(node, "translation", self.file.array(places))
        return {"node": node}

    def gaze(self, turns: NDArray[np.float64]) -> int:
        """A node that turns as the eyes do."""
        node = self._node("LookAt")
        self._turn(node, turns)
        return node

    def finish(self) -> None:
        self.file.json["nodes"] = self.nodes
        self.file.json["scenes"] = [{"nodes": self.roots}]
        self.file.json["animations"] = [self.speech.animation()]

    def _node(self, name: str) -> int:
        self.nodes.append({"name": name})
        self.roots.append(len(self.nodes) - 1)
        return self.roots[-1]

    def _turn(self, node: int, turns: NDArray[Any]) -> None:
        self.speech.move(node, "rotation", self.file.array(unit_xyzw(turns)))
