"""How each viseme looks at its clearest, as weights of the head's shapes.

The fifteen visemes of the Oculus set, and W: lips rounder and closer than for `ou`.
Weights were set by looking at renders of the built-in head (docs/images/visemes.jpg).
"""

from __future__ import annotations


def _both(name: str, weight: float) -> dict[str, float]:
    return {f"{name}Left": weight, f"{name}Right": weight}


LABIODENTAL = {"jawOpen": 0.04, "mouthLabiodental": 1.0}
"""The lower lip on the incisors, which are seen under the upper lip."""
VISEME_SHAPES: dict[str, dict[str, float]] = {
    "sil": {},
    "PP": {"jawOpen": 0.06, "mouthClose": 0.06, **_both("mouthPress", 0.5)},
    "FF": LABIODENTAL,
    "TH": {
        "jawOpen": 0.16,
        "tongueDental": 1.0,
        **_both("mouthLowerDown", 0.18),
        **_both("mouthUpperUp", 0.08),
    },
    "DD": {
        "jawOpen": 0.07,
        "tongueTipUp": 1.0,
        **_both("mouthLowerDown", 0.27),
        **_both("mouthUpperUp", 0.04),
        **_both("mouthStretch", 0.18),
    },
    "kk": {"jawOpen": 0.25},
    "CH": {
        "jawOpen": 0.055,
        "mouthFunnel": 0.30,
        "mouthPucker": 0.30,
        **_both("mouthLowerDown", 0.04),
    },
    "SS": {
        "jawOpen": 0.055,
        **_both("mouthLowerDown", 0.165),
        **_both("mouthUpperUp", 0.06),
        **_both("mouthStretch", 0.23),
    },
    "nn": {
        "jawOpen": 0.18,
        "tongueTipUp": 1.0,
        **_both("mouthLowerDown", 0.08),
    },
    "RR": {"jawOpen": 0.11, "mouthFunnel": 0.28, "mouthPucker": 0.30},
    "aa": {
        "jawOpen": 0.405,
        "mouthFunnel": 0.11,
        "mouthPucker": 0.05,
        **_both("mouthLowerDown", 0.2),
        **_both("mouthUpperUp", 0.08),
    },
    "E": {
        "jawOpen": 0.235,
        **_both("mouthLowerDown", 0.22),
        **_both("mouthUpperUp", 0.13),
        **_both("mouthStretch", 0.10),
    },
    "ih": {
        "jawOpen": 0.13,
        **_both("mouthLowerDown", 0.15),
        **_both("mouthUpperUp", 0.18),
        **_both("mouthStretch", 0.28),
        **_both("mouthSmile", 0.24),
    },
    "oh": {"jawOpen": 0.21, "mouthFunnel": 0.30, "mouthPucker": 0.28},
    "ou": {"jawOpen": 0.06, "mouthFunnel": 0.26, "mouthPucker": 0.68},
    "W": {"jawOpen": 0.04, "mouthPucker": 0.95},
}
