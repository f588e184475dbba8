"""Converts a motion of the built-in head to weights and joint turns of a character.

What its own shapes do to its mouth is measured on the mesh in its file.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from elocute.array_types import Float32Array, Float64Array, IntArray
from elocute.errors import ElocuteError, HeadError
from elocute.head.character import Character, Control, Turn
from elocute.meshes.gltf_arrays import GltfArrays
from elocute.meshes.gltf_nodes import NodeTree, rest_turn, without_matrix
from elocute.meshes.mesh_file import MeshPart
from elocute.meshes.parts import document_parts
from elocute.motion.control_fit import fit_controls, is_of_mouth
from elocute.motion.motion import Motion
from elocute.motion.mouth_seam import MeasuredMouth, find_mouth
from elocute.numerics.quaternions import from_axis_angle, multiply, no_turn

OPENERS = 3
"""Shapes that open the jaw widest, by which together a mouth is found."""
SWITCHED = 0.5
"""From this weight on a control that is off or on is on."""
STILL = 1e-6
UNREADABLE = (ElocuteError, ArithmeticError, ValueError, TypeError, LookupError, MemoryError)
"""What meshes raise that are damaged or packed."""
OVERRIDDEN: dict[str, Callable[[str], bool]] = {
    "blink": lambda curve: curve.startswith("eyeBlink"),
    "lookAt": lambda curve: curve.startswith("eyeLook"),
    "mouth": is_of_mouth,
}
"""By its name in a VRM: whether a curve is of it."""


@dataclass(frozen=True, eq=False)
class CharacterMotion:
    """What moves in a character's file."""

    weights: dict[int, Float32Array]  # (frame, target) of the morph targets, by node
    # (frame, 4) quaternions xyzw of joints that turn, by node, in place of their rest
    turns: dict[int, Float32Array]
    controls: dict[str, Float32Array]  # (frame,) weights of the controls, by name
    # how far a fitted mouth is from the motion, in the built-in head's size; {} without one
    residual_mm: dict[str, float]


def character_motion(motion: Motion, character: Character) -> CharacterMotion:
    """What moves in a character's file where a motion of the built-in head is played on it."""
    controls, residual = _control_weights(motion, character)
    tree = NodeTree(character.document)
    turns: dict[int, Float32Array] = {}
    for turn in character.turns:
        turned = _turned(motion, turn, controls, tree, character.axes)
        if turned is not None:
            turns[turn.node] = turned
    return CharacterMotion(_target_weights(character, controls), turns, controls, residual)


def _control_weights(
    motion: Motion, character: Character
) -> tuple[dict[str, Float32Array], dict[str, float]]:
    """(frame,) weights by name, and what a fit leaves."""
    controls = character.controls
    weights = {each.name: _shared(motion, each.shares) for each in controls if not each.fitted}
    residual: dict[str, float] = {}
    mouth, own = mouth_controls(character), measured_mouth(character)
    fitted = any(each.fitted for each in mouth)
    if fitted or own is not None:
        named = None if fitted else np.stack([weights[each.name] for each in mouth], axis=1)
        fit = fit_controls(motion, [each.looks for each in mouth], own, named)
        weights |= {each.name: fit.weights[:, place] for place, each in enumerate(mouth)}
        residual = fit.residual()
    for control in controls:
        if control.switch:
            weights[control.name] = (weights[control.name] >= SWITCHED).astype(np.float32)
    return _overridden(weights, controls), residual


def _overridden(
    weights: dict[str, Float32Array], controls: tuple[Control, ...]
) -> dict[str, Float32Array]:
    """Weights without what expressions of a VRM take away of blinks, gaze and mouth.

    One of the same kind takes nothing of its own; a switch is off where anything is taken.
    """
    left = {}
    for kind in OVERRIDDEN:
        taken = [
            (weights[each.name] > 0 if each.overrides[kind] == "block" else weights[each.name])
            for each in controls
            if kind in each.overrides and kind not in _kinds(each)
        ]
        if taken:
            left[kind] = np.clip(1 - np.sum(taken, axis=0), 0, 1).astype(np.float32)
    overridden = dict(weights)
    for control in controls:
        for kind in _kinds(control) & set(left):
            share = left[kind] >= 1 if control.switch else left[kind]
            overridden[control.name] = (overridden[control.name] * share).astype(np.float32)
    return overridden


def _kinds(control: Control) -> set[str]:
    """What a control is to a VRM: a blink, a look, a mouth."""
    return {kind for curve in control.looks for kind, is_of in OVERRIDDEN.items() if is_of(curve)}


def _shared(motion: Motion, shares: dict[str, float]) -> Float32Array:
    """Shares of curves, added up: never beyond one, or beyond what a curve had by itself."""
    total = np.zeros(motion.frame_count, np.float32)
    limit = np.ones_like(total)
    for name, share in shares.items():
        if name in motion.names:
            curve = motion.weights[:, motion.names.index(name)]
            total += np.float32(share) * curve
            limit = np.maximum(limit, share * curve)
    return np.minimum(total, limit).astype(np.float32)


def _target_weights(
    character: Character, controls: dict[str, Float32Array]
) -> dict[int, Float32Array]:
    """What nothing moves keeps the weight that the file gives it; what is moved starts at zero."""
    nodes, meshes = character.document.records("nodes"), character.document.records("meshes")
    moved: dict[int, dict[int, Float64Array]] = {mesh: {} for mesh in character.meshes}
    frames = max((len(each) for each in controls.values()), default=1)
    for control in character.controls:
        for mesh, target, share in control.binds:
            column = moved[mesh].setdefault(target, np.zeros(frames))
            column += share * controls[control.name]
    result = {}
    for node in character.nodes:
        mesh = nodes[node]["mesh"]
        count = character.target_count(mesh)
        rest = nodes[node].get("weights", meshes[mesh].get("weights", [0.0] * count))
        table = np.tile(np.array(rest, np.float32), (frames, 1))
        for target, column in moved[mesh].items():
            table[:, target] = column
        result[node] = table
    return result


def _turned(
    motion: Motion,
    turn: Turn,
    controls: dict[str, Float32Array],
    tree: NodeTree,
    facing: Float64Array,
) -> Float32Array | None:
    """(frame, 4) xyzw of a joint; None where it rests throughout, or cannot be turned."""
    wanted = no_turn(motion.frame_count).astype(np.float64)
    if motion.rotations is not None:
        for name in turn.joints:
            if name in motion.head.joint_names:
                joint = motion.head.joint_names.index(name)
                wanted = multiply(wanted, motion.rotations[:, joint])
    degrees = np.zeros((motion.frame_count, 3))
    for name, (nod, side) in turn.controls.items():
        degrees[:, 0] += nod * controls[name]
        degrees[:, 1] += side * controls[name]
    wanted = multiply(wanted, from_axis_angle(np.radians(degrees)))
    record, axes = without_matrix(tree.nodes[turn.node]), tree.axes(turn.node)
    if record is None or axes is None or np.abs(wanted[:, 1:]).max() < STILL:
        return None
    # From the built-in head's axes to the scene's, to those of what the joint hangs from; where
    # these are a mirror image, turns go the other way round.
    axis = np.linalg.det(axes) * wanted[:, 1:] @ facing.T @ axes
    inside = np.concatenate([wanted[:, :1], axis], axis=1)
    placed = _without_leaps(multiply(inside, rest_turn(record)))
    placed /= np.linalg.norm(placed, axis=1, keepdims=True)
    return placed[:, [1, 2, 3, 0]].astype(np.float32)


def _without_leaps(turns: Float64Array) -> Float64Array:
    """The same rotations, each with the sign that is nearer to the one before."""
    leaps = (turns[1:] * turns[:-1]).sum(axis=1) < 0
    signs = np.cumprod(np.concatenate([[1.0], np.where(leaps, -1.0, 1.0)]))
    return turns * signs[:, None]


def conversion_record(character: Character, moved: CharacterMotion) -> dict[str, Any]:
    """What was done, for the file."""
    record: dict[str, Any] = {
        "controls": [control.name for control in character.controls if control.binds],
        "joints": [turn.node for turn in character.turns if turn.node in moved.turns],
    }
    return record | ({"residual_mm": moved.residual_mm} if moved.residual_mm else {})


def mouth_controls(character: Character) -> list[Control]:
    """What moves a character's mouth: all that is fitted, or else what takes curves of a mouth."""
    fitted = [each for each in character.controls if each.fitted]
    return fitted or [each for each in character.controls if any(map(is_of_mouth, each.looks))]


def measured_mouth(character: Character) -> MeasuredMouth | None:
    """The mouth of a character, with the effects of `mouth_controls`.

    None where its mesh cannot be read, or has no lips that these part.
    """
    controls = mouth_controls(character)
    try:
        with np.errstate(all="ignore"):
            mesh = CharacterMesh(character)
            drop = mesh.drop()
            mouth = find_mouth(
                mesh.points,
                mesh.triangles,
                drop,
                lambda used: np.stack([mesh.moved(each, used) for each in controls]),
            )
        return mouth if mouth is not None and np.isfinite(mouth.effects).all() else None
    except UNREADABLE:  # it speaks without: nothing else needs its vertices
        return None


def bare_parts(character: Character, arrays: GltfArrays | None = None) -> tuple[MeshPart, ...]:
    """The meshes of a character's file at rest, without their materials. Raises HeadError."""
    document = character.document
    plain: dict[str, Any] = {"images": []}
    plain["materials"] = [{} for _ in document.records("materials")]
    bare = replace(document, record=document.record | plain)
    return document_parts(bare, Path(character.name), HeadError, arrays)


class CharacterMesh:
    """The meshes of a character that are moved, in one space: x to its left, y up, z ahead.

    points: (vertex, 3) of these; around: (vertex, 3) of all meshes.
    """

    def __init__(self, character: Character) -> None:
        document = character.document
        parts = [(p, p.origin) for p in bare_parts(character)]
        self._parts = [(p, at) for p, at in parts if at and at.node in character.nodes]
        self.around = np.concatenate([part.vertices for part, _ in parts]) @ character.axes
        self._character = character
        self._arrays, self._meshes = GltfArrays(document), document.records("meshes")
        self._axes = character.axes
        self._starts = np.cumsum([0, *(len(part.vertices) for part, _ in self._parts)])
        self.points = np.concatenate([part.vertices for part, _ in self._parts]) @ self._axes
        self.triangles = np.concatenate(
            [p.triangles + at for (p, _), at in zip(self._parts, self._starts, strict=False)]
        )

    def opening(self, most: int = OPENERS) -> Float64Array:
        """(vertex, 3) how each moves by the shapes, `most` of them, that open the mouth widest."""
        openers = [each for each in mouth_controls(self._character) if each.binds]
        openers = [each for each in openers if each.looks.get("jawOpen", 0.0) > 0]
        openers.sort(key=lambda each: -each.looks["jawOpen"])
        total = np.zeros_like(self.points)
        for each in openers[:most]:
            total += self.moved(each)
        return total

    def drop(self) -> Float64Array:
        """(vertex,) how far each goes down where the mouth is opened widest."""
        return -self.opening()[:, 1]

    def moved(self, control: Control, used: IntArray | None = None) -> Float64Array:
        """(vertex, 3) of a control in full; used: rising, of all vertices."""
        parts = []
        for (part, origin), start in zip(self._parts, self._starts, strict=False):
            rows = np.arange(len(part.vertices))
            if used is not None:
                rows = used[(used >= start) & (used < start + len(rows))] - start
            total = np.zeros((len(rows), 3))
            targets = self._meshes[origin.mesh]["primitives"][origin.primitive].get("targets", [])
            for mesh, target, share in control.binds if targets else ():
                if mesh == origin.mesh and "POSITION" in targets[target] and len(rows):
                    values = self._arrays.values(targets[target]["POSITION"])
                    total += share * values[origin.rows[rows], :3]
            parts.append(np.einsum("vab,vb->va", origin.linear[rows], total))
        return np.concatenate(parts) @ self._axes
