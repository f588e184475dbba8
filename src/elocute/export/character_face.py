"""Finds where the face of a character is, so that pictures show it as they show other heads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.export.character_weights import CharacterMesh
from elocute.head.character import Character
from elocute.meshes.gltf_nodes import NodeTree

CHIN = 0.3
"""Share of the furthest drop of an open jaw from which on what drops is the jaw, not the neck."""
LIPS, LIP_OF_CHIN = 0.43, 0.72
"""What drops and is less high than this, by its breadth, is lips alone; and how far from the eyes
to the chin a lower lip is."""
LID = 0.5
"""Share of a blink's furthest move from which on what moves is the lid."""
EYES_OF_CROWN = 0.8
"""From the chin to the eyes, as a share of the way on to the crown, where only that is known."""
HEAD_HIGH = 12.0
"""What moves has this many times its width in height where it is no body: a head, or a bust."""
LIKELY = (0.12, 0.8)
"""From the chin to the eyes, as a share of all from the chin to the crown: hair may be high."""


@dataclass(frozen=True, eq=False)
class FacePlace:
    """Where a face is, in the axes of heads and the file's unit."""

    eyes: Float64Array  # (3,) between them
    chin: float  # how high

    @property
    def high(self) -> float:
        """From the chin to the eyes."""
        return float(self.eyes[1]) - self.chin


def face_place(
    character: Character, tree: NodeTree, points: Float64Array, skull: NDArray[np.bool_]
) -> FacePlace:
    """The face of a character.

    By its eyes' joints or by what a blink moves, and by what an open jaw takes along; what cannot
    be found by these is guessed from the rest.

    points: (vertex, 3) of all its meshes; skull: (vertex,) which hang from its head.
    """
    own = points[skull] if skull.any() else points
    mesh = CharacterMesh(character)
    drop = mesh.drop()
    chin, jaw = None, own[:0]
    if drop.max(initial=0) > 0:
        jaw = mesh.points[drop >= CHIN * drop.max()]
        chin, middle = float(jaw[:, 1].min()), float(jaw[:, 0].min() + jaw[:, 0].max()) / 2
        own = own if skull.any() else _near(mesh.points, jaw)
    else:
        middle = float(own[:, 0].min() + own[:, 0].max()) / 2
    crown, ahead = float(own[:, 1].max()), float(own[:, 2].max())
    eyes = _eyes(character, tree, mesh, middle)
    if eyes is None:
        if not skull.any() and _is_head(mesh.points, drop):
            chin, crown = None, float(mesh.points[:, 1].max())
            own = mesh.points
        low = float(own[:, 1].min()) if chin is None else chin
        share = EYES_OF_CROWN / (1 + EYES_OF_CROWN)
        eyes = np.array([middle, low + share * (crown - low), ahead])
    elif chin is not None and np.ptp(jaw[:, 1]) < LIPS * np.ptp(jaw[:, 0]):
        chin = float(eyes[1]) - (float(eyes[1]) - chin) / LIP_OF_CHIN
    if chin is None:
        chin = float(eyes[1]) - EYES_OF_CROWN * (crown - float(eyes[1]))
    high = max(crown - chin, 1e-9)
    if not LIKELY[0] < (float(eyes[1]) - chin) / high < LIKELY[1]:
        low = float(own[:, 1].min())
        high = max(crown - low, 1e-6)
        return FacePlace(np.array([middle, low + high / 2, ahead]), low)
    return FacePlace(eyes, chin)


def _is_head(points: Float64Array, drop: Float64Array) -> bool:
    """Whether a mesh ends with its head, by how broad what drops is: lips alone, as where mouths
    are drawn."""
    lips = points[drop >= CHIN * drop.max(initial=0)]
    return bool(np.ptp(points[:, 1]) < HEAD_HIGH * np.ptp(lips[:, 0]))


def _near(points: Float64Array, jaw: Float64Array) -> Float64Array:
    """What of a mesh may be a head: above its jaw, and not far from it."""
    wide = max(float(np.ptp(jaw[:, 0])), 1e-9)
    low, middle = jaw[:, 1].min(), jaw.mean(axis=0)
    off = np.abs(points[:, [0, 2]] - middle[[0, 2]]).max(axis=1)
    up = points[:, 1] - low
    return points[(up >= 0) & (up < 4 * wide) & (off < 3 * wide)]


def _eyes(
    character: Character, tree: NodeTree, mesh: CharacterMesh, middle: float
) -> Float64Array | None:
    """(3,) between the eyes; None where neither joints nor lids say it."""
    joints = [turn.node for turn in character.turns if turn.joints[-1].startswith("eye")]
    places = [tree.world(node)[:3, 3] @ character.axes for node in joints]
    if len(places) != 2 or np.ptp([place[0] for place in places]) < 1e-9:
        places = []
        for side in ("Left", "Right"):
            name = f"eyeBlink{side}"
            looks = [each for each in character.controls if each.binds and each.looks.get(name)]
            if looks:
                moves = np.linalg.norm(mesh.moved(looks[0]), axis=1)
                lid = moves >= max(LID * moves.max(initial=0), 1e-12)
                if lid.any():
                    places.append(mesh.points[lid].mean(axis=0))
    if not places:
        return None
    between = np.mean(places, axis=0)
    return between if len(places) == 2 else np.array([middle, *between[1:]])
