"""How each viseme looks at its clearest, as weights of the head's shapes.

The fifteen visemes of the Oculus set, and W: lips rounder and closer than for `ou`.
Weights were set by looking at renders of the built-in head (docs/images/visemes.jpg).
"""

from __future__ import annotations


def _both(name: str, weight: float) -> dict[str, float]:
    return {f"{name}Left": weight, f"{name}Right": weight}


VISEME_SHAPES: dict[str, dict[str, float]] = {
    "sil": {},
    "PP": {"jawOpen": 0.06, "mouthClose": 0.06, **_both("mouthPress", 0.45)},
    "FF": {"jawOpen": 0.04, "mouthLabiodental": 1.0},
    "TH": {"jawOpen": 0.14, "tongueDental": 1.0, **_both("mouthLowerDown", 0.16),
           **_both("mouthUpperUp", 0.06)},
    "DD": {"jawOpen": 0.13, "tongueTipUp": 1.0, **_both("mouthLowerDown", 0.16),
           **_both("mouthUpperUp", 0.04), **_both("mouthStretch", 0.08)},
    "kk": {"jawOpen": 0.20, **_both("mouthLowerDown", 0.12), **_both("mouthUpperUp", 0.02)},
    "CH": {"jawOpen": 0.05, "mouthFunnel": 0.50, "mouthPucker": 0.18,
           **_both("mouthUpperUp", 0.06)},
    "SS": {"jawOpen": 0.03, **_both("mouthLowerDown", 0.30), **_both("mouthUpperUp", 0.06),
           **_both("mouthStretch", 0.30)},
    "nn": {"jawOpen": 0.14, "tongueTipUp": 1.0, **_both("mouthLowerDown", 0.12),
           **_both("mouthUpperUp", 0.02)},
    "RR": {"jawOpen": 0.10, "mouthFunnel": 0.28, "mouthPucker": 0.30},
    "aa": {"jawOpen": 0.58, **_both("mouthLowerDown", 0.08), **_both("mouthUpperUp", 0.06)},
    "E": {"jawOpen": 0.32, **_both("mouthLowerDown", 0.16), **_both("mouthUpperUp", 0.06),
          **_both("mouthStretch", 0.30)},
    "ih": {"jawOpen": 0.17, **_both("mouthLowerDown", 0.20), **_both("mouthUpperUp", 0.06),
           **_both("mouthStretch", 0.30), **_both("mouthSmile", 0.15)},
    "oh": {"jawOpen": 0.36, "mouthFunnel": 0.40, "mouthPucker": 0.25},
    "ou": {"jawOpen": 0.16, "mouthFunnel": 0.15, "mouthPucker": 0.75},
    "W": {"jawOpen": 0.05, "mouthPucker": 0.95},
}  # fmt: skip
