"""Articulatory targets: the mouth's target shape for each phone, and its dominance.

Targets are mixtures of the viseme shapes that the head was sculpted for; dominances follow
Cohen and Massaro (1993): high for the jaw of a sibilant and the lips of a rounded vowel, low for
all of k. Numbers were set by hand from phonetics, then checked by looking; no recording
was fitted.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from elocute.encoders.phones_and_visemes import PHONES
from elocute.head.viseme_shapes import VISEME_SHAPES

# Curves move in four groups, each with its own dominance.
GROUPS = ("jaw", "lips", "rounding", "tongue")
_GROUP_OF = {
    "jaw": ("jawOpen", "jawForward"),
    "rounding": (
        "mouthPucker",
        "mouthFunnel",
        "mouthStretchLeft",
        "mouthStretchRight",
        "mouthSmileLeft",
        "mouthSmileRight",
        "mouthDimpleLeft",
        "mouthDimpleRight",
    ),
    "tongue": ("tongueTipUp", "tongueDental", "tongueOut"),
}

# Blending with neighbours takes about a third off every opening; targets overshoot by as much.
OVERSHOOT = 1.45
_OVERSHOT = ("jawOpen", "mouthLowerDown", "mouthUpperUp")

# A diphthong travels: the first half of its posterior goes to one vowel, the second to another.
DIPHTHONGS = {
    "AW": ("AA", "UH"),
    "AY": ("AA", "IH"),
    "EY": ("EH", "IY"),
    "OW": ("AO", "UW"),
    "OY": ("AO", "IH"),
}

# phone: (viseme mixture, dominance of jaw, lips, rounding, tongue)
_Target = tuple[dict[str, float], tuple[float, float, float, float]]
_TARGETS: dict[str, _Target] = {
    "SIL": ({"sil": 1.0}, (0.02, 0.02, 0.02, 0.1)),
    "AA": ({"aa": 1.0}, (1.0, 1.0, 0.7, 0.3)),
    "AE": ({"aa": 0.70, "E": 0.35}, (1.0, 1.0, 0.7, 0.3)),
    "AH": ({"aa": 0.55, "E": 0.10}, (0.7, 0.7, 0.4, 0.2)),
    "AO": ({"oh": 0.90}, (1.0, 1.0, 1.0, 0.3)),
    "EH": ({"E": 1.0, "aa": 0.12}, (0.9, 0.9, 0.7, 0.3)),
    "ER": ({"RR": 0.75}, (0.7, 0.7, 0.7, 0.4)),
    "IH": ({"ih": 1.0, "E": 0.20}, (0.7, 0.7, 0.6, 0.3)),
    "IY": ({"ih": 1.0, "E": 0.15}, (0.8, 0.8, 0.9, 0.3)),
    "UH": ({"ou": 0.50, "oh": 0.45}, (0.8, 0.8, 0.8, 0.3)),
    "UW": ({"ou": 1.0}, (0.9, 0.9, 1.2, 0.3)),
    "W": ({"W": 0.9}, (1.4, 1.5, 1.5, 0.3)),
    "Y": ({"ih": 0.75}, (0.5, 0.5, 0.5, 0.4)),
    "R": ({"RR": 0.50}, (1.0, 1.0, 0.9, 0.5)),
    "HH": ({"kk": 0.8, "aa": 0.15}, (0.2, 0.2, 0.1, 0.1)),
    "L": ({"nn": 1.0, "aa": 0.1}, (0.4, 0.4, 0.2, 1.2)),
    "N": ({"nn": 0.9}, (0.45, 0.45, 0.2, 1.0)),
    "T": ({"DD": 1.0, "aa": 0.07}, (0.45, 0.45, 0.2, 1.0)),
    "D": ({"DD": 1.0, "aa": 0.07}, (0.45, 0.45, 0.2, 1.0)),
    "TH": ({"TH": 0.65}, (0.7, 0.7, 0.3, 1.4)),
    "DH": ({"TH": 0.60}, (0.5, 0.5, 0.2, 1.2)),
    "S": ({"SS": 1.0, "E": 0.2}, (0.6, 0.6, 0.5, 0.5)),
    "Z": ({"SS": 1.0, "E": 0.2}, (0.6, 0.6, 0.5, 0.5)),
    "SH": ({"CH": 1.0, "oh": 0.2}, (0.8, 0.8, 1.1, 0.5)),
    "ZH": ({"CH": 1.0, "oh": 0.2}, (0.8, 0.8, 1.1, 0.5)),
    "CH": ({"CH": 1.0, "oh": 0.2}, (0.8, 0.8, 1.0, 0.6)),
    "JH": ({"CH": 1.0, "oh": 0.2}, (0.8, 0.8, 1.0, 0.6)),
    "K": ({"kk": 1.0}, (0.3, 0.25, 0.1, 0.2)),
    "G": ({"kk": 1.0}, (0.3, 0.25, 0.1, 0.2)),
    "NG": ({"kk": 0.9}, (0.3, 0.25, 0.1, 0.2)),
    # Closures and labiodentals are made after everything else; here they only
    # keep their neighbours' jaw low.
    "P": ({"sil": 1.0}, (1.5, 1.5, 0.05, 0.1)),
    "B": ({"sil": 1.0}, (1.5, 1.5, 0.05, 0.1)),
    "M": ({"sil": 1.0}, (1.5, 1.5, 0.05, 0.1)),
    "F": ({"sil": 1.0}, (1.7, 1.7, 0.1, 0.1)),
    "V": ({"sil": 1.0}, (1.7, 1.7, 0.1, 0.1)),
}


def _group(curve: str) -> str:
    return next((group for group, names in _GROUP_OF.items() if curve in names), "lips")


@cache
def curve_names() -> tuple[str, ...]:
    """The names of the curves that visemes use, in a fixed order."""
    return tuple(sorted({curve for shape in VISEME_SHAPES.values() for curve in shape}))


@cache
def curve_groups() -> NDArray[np.intp]:
    """(curve,) index into GROUPS."""
    return np.array([GROUPS.index(_group(curve)) for curve in curve_names()])


@cache
def phone_targets() -> NDArray[np.float32]:
    """(phone, curve) weights; a diphthong's row is zero, since its posterior is split first."""
    names = curve_names()
    table = np.zeros((len(PHONES), len(names)), np.float32)
    for phone, (mixture, _) in _TARGETS.items():
        for viseme, share in mixture.items():
            for curve, weight in VISEME_SHAPES[viseme].items():
                gain = OVERSHOOT if curve.startswith(_OVERSHOT) else 1.0
                table[PHONES.index(phone), names.index(curve)] += gain * share * weight
    return table


@cache
def phone_dominances() -> NDArray[np.float32]:
    """(phone, group) dominance of each phone over each group of curves."""
    table = np.zeros((len(PHONES), len(GROUPS)), np.float32)
    for phone, (_, dominance) in _TARGETS.items():
        table[PHONES.index(phone)] = dominance
    return table
