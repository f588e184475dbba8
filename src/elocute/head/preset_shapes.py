"""Shapes of other standards as weights of the built-in head's shapes.

The fifteen visemes of the Oculus set as avatars name them, and the expressions of VRM 1.0. Names of
feelings without a side are set on both.
"""

from __future__ import annotations

from elocute.head.feeling_shapes import FEELING_SHAPES
from elocute.head.viseme_shapes import VISEME_SHAPES

SILENT = "viseme_sil"
OCULUS_SHAPES: dict[str, dict[str, float]] = {
    f"viseme_{name}": VISEME_SHAPES[own]
    for name, own in (
        *((each, each) for each in ("sil", "PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR")),
        *(("aa", "aa"), ("E", "E"), ("I", "ih"), ("O", "oh"), ("U", "ou")),
    )
}
VRM_MOUTH: dict[str, dict[str, float]] = {
    "aa": VISEME_SHAPES["aa"],
    "ih": VISEME_SHAPES["ih"],
    "ou": VISEME_SHAPES["ou"],
    "ee": VISEME_SHAPES["E"],
    "oh": VISEME_SHAPES["oh"],
}
VRM_LIDS: dict[str, dict[str, float]] = {
    "blink": {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0},
    "blinkLeft": {"eyeBlinkLeft": 1.0},
    "blinkRight": {"eyeBlinkRight": 1.0},
}
VRM_GAZE: dict[str, dict[str, float]] = {
    "lookUp": {"eyeLookUpLeft": 1.0, "eyeLookUpRight": 1.0},
    "lookDown": {"eyeLookDownLeft": 1.0, "eyeLookDownRight": 1.0},
    "lookLeft": {"eyeLookOutLeft": 1.0, "eyeLookInRight": 1.0},
    "lookRight": {"eyeLookInLeft": 1.0, "eyeLookOutRight": 1.0},
}
VRM_FEELINGS: dict[str, dict[str, float]] = {
    "happy": FEELING_SHAPES["happy"],
    "angry": FEELING_SHAPES["angry"],
    "sad": FEELING_SHAPES["sad"],
    "relaxed": FEELING_SHAPES["tender"],
    "surprised": FEELING_SHAPES["surprised"],
}
