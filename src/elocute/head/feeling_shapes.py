"""Resting faces of feelings, as weights of the head's shapes.

Names without a side are set on both. What else a feeling does (how the head is held, how much moves
while somebody speaks) is `life.moods`.
"""

from __future__ import annotations

from collections.abc import Mapping

FEELING_SHAPES: dict[str, dict[str, float]] = {
    "happy": {
        "mouthSmile": 0.62,
        "mouthDimple": 0.12,
        "cheekSquint": 0.45,
        "eyeSquint": 0.16,
        "browInnerUp": 0.10,
        "browOuterUp": 0.16,
    },
    "sad": {
        "browInnerUp": 0.85,
        "browDown": 0.12,
        "mouthFrown": 0.55,
        "mouthShrugLower": 0.18,
        "eyeBlink": 0.16,
        "eyeSquint": 0.10,
    },
    "angry": {
        "browDown": 0.9,
        "noseSneer": 0.42,
        "eyeSquint": 0.40,
        "eyeWide": 0.10,
        "mouthPress": 0.16,
        "mouthFrown": 0.26,
        "jawForward": 0.10,
    },
    "surprised": {"browInnerUp": 0.8, "browOuterUp": 0.8, "eyeWide": 0.8},
    "tender": {
        "mouthSmile": 0.32,
        "mouthDimple": 0.08,
        "cheekSquint": 0.22,
        "eyeSquint": 0.10,
        "browInnerUp": 0.45,
        "eyeBlink": 0.10,
    },
}


def both_sides(looks: Mapping[str, float], names: tuple[str, ...]) -> dict[str, float]:
    """The same weights by the names of a head's shapes: one that has two sides is set on both.

    `looks` name shapes with or without a side; those that the head lacks are left out.
    """
    weights: dict[str, float] = {}
    for name, weight in looks.items():
        sided = [name] if name in names else [f"{name}{side}" for side in ("Left", "Right")]
        weights |= {each: weight for each in sided if each in names}
    return weights
