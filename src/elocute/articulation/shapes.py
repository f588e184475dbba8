"""How each viseme looks at its clearest, as weights of the head's shapes."""

from __future__ import annotations


def _both(name: str, weight: float) -> dict[str, float]:
    return {f"{name}Left": weight, f"{name}Right": weight}


VISEME_SHAPES: dict[str, dict[str, float]] = {
    "sil": {},
    "PP": {"jawOpen": 0.05, "mouthClose": 0.05, **_both("mouthPress", 0.35)},
    "FF": {"jawOpen": 0.05, "mouthLabiodental": 1.0, **_both("mouthUpperUp", 0.12)},
    "TH": {"jawOpen": 0.16, "tongueDental": 0.9, **_both("mouthLowerDown", 0.22),
           **_both("mouthUpperUp", 0.12)},
    "DD": {"jawOpen": 0.13, "tongueTipUp": 0.8, **_both("mouthLowerDown", 0.22),
           **_both("mouthUpperUp", 0.10), **_both("mouthStretch", 0.08)},
    "kk": {"jawOpen": 0.18, **_both("mouthLowerDown", 0.15), **_both("mouthUpperUp", 0.08)},
    "CH": {"jawOpen": 0.08, "mouthFunnel": 0.45, "mouthPucker": 0.25},
    "SS": {"jawOpen": 0.06, **_both("mouthLowerDown", 0.28), **_both("mouthUpperUp", 0.12),
           **_both("mouthStretch", 0.18)},
    "nn": {"jawOpen": 0.14, "tongueTipUp": 0.9, **_both("mouthLowerDown", 0.18),
           **_both("mouthUpperUp", 0.08)},
    "RR": {"jawOpen": 0.12, "mouthFunnel": 0.22, "mouthPucker": 0.28},
    "aa": {"jawOpen": 0.55, **_both("mouthLowerDown", 0.12), **_both("mouthUpperUp", 0.10)},
    "E": {"jawOpen": 0.33, **_both("mouthLowerDown", 0.20), **_both("mouthUpperUp", 0.12),
          **_both("mouthStretch", 0.22)},
    "ih": {"jawOpen": 0.20, **_both("mouthLowerDown", 0.20), **_both("mouthUpperUp", 0.10),
           **_both("mouthStretch", 0.22), **_both("mouthSmile", 0.10)},
    "oh": {"jawOpen": 0.34, "mouthFunnel": 0.30, "mouthPucker": 0.28},
    "ou": {"jawOpen": 0.16, "mouthFunnel": 0.15, "mouthPucker": 0.72},
    "W": {"jawOpen": 0.07, "mouthFunnel": 0.06, "mouthPucker": 0.90},
}  # fmt: skip
