"""Jaw and lips."""

from __future__ import annotations

import numpy as np

from .face import NeutralFace
from .jaw import FORWARD_M, OPEN_DEG, SIDE_DEG
from .lips import COLUMN_COUNT, RING_COUNT


def mouth_shapes(face: NeutralFace) -> dict[str, np.ndarray]:
    shapes = {
        "jawOpen": face.jaw(open_deg=OPEN_DEG),
        "jawForward": face.jaw(shift=(0, 0, FORWARD_M)),
        "jawLeft": face.jaw(side_deg=SIDE_DEG),
        "jawRight": face.jaw(side_deg=-SIDE_DEG),
    }
    skin = _round_shapes(face) | _closing_shapes(face, shapes["jawOpen"][face.skin_slice])
    skin |= _sided_shapes(face)
    skin["mouthLabiodental"] = _labiodental(face)
    return shapes | {name: face.of_skin(moved) for name, moved in skin.items()}


def _round_shapes(face: NeutralFace) -> dict[str, np.ndarray]:
    return {
        "mouthFunnel": face.expression("mouth-protusion"),
        "mouthPucker": face.expression("mouth-pursing"),
        "mouthLeft": face.pose_unit("MouthMoveLeft"),
        "mouthRight": face.pose_unit("MouthMoveRight"),
    }


def _closing_shapes(face: NeutralFace, jaw_open: np.ndarray) -> dict[str, np.ndarray]:
    lips = face.lips
    press = lips.roll(1.3, 1.3)
    press = press + lips.seal(face.skin + press, 0.0016)
    return {
        "mouthClose": lips.seal(
            face.skin + jaw_open, upper_share=0.4, follow=np.ones(RING_COUNT)
        ),
        "mouthRollLower": face.resealed(lips.roll(0, 3.2)),
        "mouthRollUpper": face.resealed(lips.roll(3.2, 0)),
        "mouthShrugLower": face.resealed(face.pose_unit("lowerLipUp") * 0.8, 0.0006),
        "mouthShrugUpper": face.resealed(face.pose_unit("UpperLipUp") * 0.8),
        **{f"mouthPress{side}": half for side, half in face.halves(press).items()},
    }


def _sided_shapes(face: NeutralFace) -> dict[str, np.ndarray]:
    sources = {
        "mouthSmile": face.resealed(face.expression("mouth-corner-puller")),
        "mouthFrown": face.resealed(face.expression("mouth-depression")),
        "mouthStretch": face.resealed(face.expression("mouth-retraction")),
        "mouthDimple": face.resealed(face.expression("mouth-compression") * 0.6),
        "mouthLowerDown": face.expression("mouth-depression-retraction"),
        "mouthUpperUp": face.expression("mouth-elevation"),
    }
    return {
        name + side: half
        for name, moved in sources.items()
        for side, half in face.halves(moved).items()
    }


def _labiodental(face: NeutralFace) -> np.ndarray:
    """The lower lip rises and draws in until it touches the edge of the upper incisors."""
    lips = face.lips
    teeth = face.vertices[face.assembly.slices["teeth_upper"]]
    middle = teeth[np.abs(teeth[:, 0]) < 0.016]
    edge = middle[:, 1].min()
    front = middle[middle[:, 1] < edge + 0.003][:, 2].max()
    moves = np.zeros((RING_COUNT, COLUMN_COUNT, 3))
    follow = np.array([0.25, 0.4, 0.6, 0.8, 0.95, 1, 1, 1, 0.9, 0.7])
    for column in range(13, 26):
        contact = face.skin[lips.rings[7, column]]
        reach = np.clip(1 - (contact[0] / 0.024) ** 2, 0, 1)
        goal = np.array([0, edge + 0.001 - contact[1], front + 0.0012 - contact[2]])
        moves[:, column] = follow[:, None] * goal * reach
    return lips.field(moves)
