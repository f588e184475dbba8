"""Sets of shapes by name (ARKit, visemes, Daz, MetaHuman, …) as weights of the built-in curves.

ARKit's, and those that say the same otherwise: Character Creator, MetaHuman, Unified Expressions,
Meta's and Ekman's action units, faceshift, Daz, Mixamo, MB-Lab, VRoid; and visemes: Oculus's,
Microsoft's 22, Character Creator's, Daz's, Preston Blair's chart, Rhubarb's letters, phones and
vowels.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from elocute.head.preset_shapes import VRM_GAZE, VRM_LIDS, VRM_MOUTH
from elocute.head.viseme_shapes import VISEME_SHAPES
from elocute.motion.curves import ARKIT_NAMES

SIDES = ("Left", "Right")
Looks = dict[str, float]
Row = tuple[str, str, Looks, bool]
"""A spelling, whose it is, what it does, and whether it is one of several that do it together."""


def both(*names: str) -> Looks:
    """Both sides of shapes in full."""
    return {f"{name}{side}": 1.0 for name in names for side in SIDES}


def _mixed(**shares: float) -> Looks:
    """Shares of visemes, added up."""
    looks: Looks = {}
    for name, share in shares.items():
        for curve, weight in VISEME_SHAPES[name].items():
            looks[curve] = round(looks.get(curve, 0.0) + share * weight, 4)
    return looks


OCULUS = {
    **{name: name for name in ("sil", "PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR", "aa")},
    "E": "E",
    "I": "ih",
    "ih": "ih",
    "O": "oh",
    "oh": "oh",
    "U": "ou",
    "ou": "ou",
}
_VOWELS: dict[str, Looks] = {
    **dict.fromkeys(("a", "aa", "ai", "aah", "bigaah"), VISEME_SHAPES["aa"]),
    **dict.fromkeys(("i", "ih", "iy"), VISEME_SHAPES["ih"]),
    **dict.fromkeys(("u", "ou", "uw", "oo", "ooh", "oohq"), VISEME_SHAPES["ou"]),
    **dict.fromkeys(("e", "ee", "eee", "eh", "ey"), VISEME_SHAPES["E"]),
    **dict.fromkeys(("o", "oh", "ao"), VISEME_SHAPES["oh"]),
    "ae": _mixed(aa=0.7, E=0.35),
    "ah": _mixed(aa=0.55, E=0.1),
    "aw": _mixed(aa=0.6, ou=0.4),
    "ay": _mixed(aa=0.6, ih=0.4),
    "er": _mixed(RR=0.75),
    "ow": _mixed(oh=0.6, ou=0.4),
    "oy": _mixed(oh=0.6, ih=0.4),
    "uh": _mixed(ou=0.5, oh=0.45),
}
_CONSONANTS: dict[str, Looks] = {
    **{name.lower(): VISEME_SHAPES[own] for name, own in OCULUS.items() if own in VISEME_SHAPES},
    **dict.fromkeys(("p", "b", "m", "mbp", "pbm", "bmp", "mpb", "mm"), VISEME_SHAPES["PP"]),
    **dict.fromkeys(("f", "v", "fv"), VISEME_SHAPES["FF"]),
    **dict.fromkeys(("dh", "thdh"), VISEME_SHAPES["TH"]),
    **dict.fromkeys(("d", "t", "dst"), VISEME_SHAPES["DD"]),
    **dict.fromkeys(("k", "g", "ng", "h", "hh"), VISEME_SHAPES["kk"]),
    **dict.fromkeys(("sh", "zh", "jh", "j", "chj", "chjsh"), VISEME_SHAPES["CH"]),
    **dict.fromkeys(("s", "z"), VISEME_SHAPES["SS"]),
    **dict.fromkeys(("n", "l", "ld"), VISEME_SHAPES["nn"]),
    **dict.fromkeys(("w", "q", "wq", "woo"), VISEME_SHAPES["W"]),
    "r": VISEME_SHAPES["RR"],
    "y": _mixed(ih=0.75),
    **{name: _mixed(SS=0.5, DD=0.5) for name in ("etc", "cdgknrsthyz", "cdgknrsyz")},
    "rest": {},
}
BARE: Mapping[str, Looks] = _CONSONANTS | _VOWELS
"""Visemes whose name is a letter or a few: they are ones only among others, with a vowel."""
BARE_VOWELS = frozenset(_VOWELS)
RHUBARB: Mapping[str, Looks] = {
    "a": VISEME_SHAPES["PP"],
    "b": VISEME_SHAPES["SS"],
    "c": VISEME_SHAPES["E"],
    "d": VISEME_SHAPES["aa"],
    "e": VISEME_SHAPES["oh"],
    "f": VISEME_SHAPES["ou"],
    "g": VISEME_SHAPES["FF"],
    "h": VISEME_SHAPES["nn"],
    "x": {},
}
"""The letters of Rhubarb Lip Sync, which say something else where there are those from A to F."""
_MICROSOFT = (
    (("sil",), {}),
    (("ae_ax_ah", "aa_ah_ax"), _mixed(aa=0.6, E=0.2)),
    (("aa",), VISEME_SHAPES["aa"]),
    (("ao",), VISEME_SHAPES["oh"]),
    (("ey_eh_uh",), VISEME_SHAPES["E"]),
    (("er",), _VOWELS["er"]),
    (("y_iy_ih_ix",), VISEME_SHAPES["ih"]),
    (("w_uw",), VISEME_SHAPES["ou"]),
    (("ow",), _VOWELS["ow"]),
    (("aw",), _VOWELS["aw"]),
    (("oy",), _VOWELS["oy"]),
    (("ay",), _VOWELS["ay"]),
    (("h",), _mixed(kk=0.8, aa=0.15)),
    (("r",), VISEME_SHAPES["RR"]),
    (("l",), VISEME_SHAPES["nn"]),
    (("s_z",), VISEME_SHAPES["SS"]),
    (("sh_ch_jh_zh",), VISEME_SHAPES["CH"]),
    (("th_dh",), VISEME_SHAPES["TH"]),
    (("f_v",), VISEME_SHAPES["FF"]),
    (("d_t_n",), VISEME_SHAPES["DD"]),
    (("k_g_ng",), VISEME_SHAPES["kk"]),
    (("p_b_m",), VISEME_SHAPES["PP"]),
)
"""By its number: what the phones of a viseme are called, and what it is."""
NUMBERED: tuple[Looks, ...] = tuple(looks for _, looks in _MICROSOFT)
VRM: dict[str, Looks] = {
    **{name.lower(): looks for name, looks in (VRM_MOUTH | VRM_LIDS | VRM_GAZE).items()},
    "a": VRM_MOUTH["aa"],
    "i": VRM_MOUTH["ih"],
    "u": VRM_MOUTH["ou"],
    "e": VRM_MOUTH["ee"],
    "o": VRM_MOUTH["oh"],
    "blinkl": VRM_LIDS["blinkLeft"],
    "blinkr": VRM_LIDS["blinkRight"],
}
_WHOLE_OF_TWO = ("browInnerUp", "cheekPuff", "mouthClose", "mouthFunnel", "mouthPucker")
_WHOLE_OF_TWO += ("mouthRollLower", "mouthRollUpper", "mouthShrugLower", "mouthShrugUpper")
"""ARKit's shapes that others split in a left and a right half."""

# What has two sides; {} is a side.
_SIDED: dict[str, tuple[str, ...]] = {
    "browDown": ("Brow_Drop_{}", "BrowLowerer{}", "BrowsDown_{}", "browSqueeze{}_max", "BrowsD_{}"),
    "browOuterUp": (
        *("Brow_Raise_Outer_{}", "browRaiseOuter{}", "BrowUp{}", "BrowsUp_{}"),
        *("browOutVert{}_max", "BrowsU_{}"),
    ),
    "eyeBlink": ("EyeClosed{}", "eyeClosed{}_max"),
    "eyeWide": ("eyeWiden{}", "EyesWide{}", "eyeClosed{}_min", "EyeOpen_{}"),
    "eyeSquint": ("eyeSquintInner{}", "Squint_{}"),
    "eyeLookUp": ("Eye_{}_Look_Up", "EyesLookUp{}", "EyeUp_{}"),
    "eyeLookDown": ("Eye_{}_Look_Down", "EyesLookDown{}", "EyeDown_{}"),
    "eyeLookIn": ("EyeIn_{}",),
    "eyeLookOut": ("EyeOut_{}",),
    "cheekSquint": ("Cheek_Raise_{}", "eyeCheekRaise{}"),
    "noseSneer": ("noseWrinkle{}", "NoseScrunch_{}", "cheekSneer{}_max", "Sneer_{}"),
    "mouthUpperUp": (
        *("Mouth_Up_Upper_{}", "Mouth_Upper_Up_{}", "mouthUpperLipRaise{}"),
        *("UpperLipUp_{}", "LipsUpperUp_{}"),
    ),
    "mouthLowerDown": (
        *("Mouth_Down_Lower_{}", "Mouth_Lower_Down_{}", "mouthLowerLipDepress{}"),
        *("LowerLipDown_{}", "LipsLowerDown_{}"),
    ),
    "mouthSmile": ("smile{}",),
    "mouthFrown": ("mouthCornerDepress{}", "MouthSad{}", "Frown_{}"),
    "mouthPress": ("mouthLipsPress{}",),
    "mouthStretch": ("LipsStretch_{}",),
}
# What several do together: quarters, halves. {} is a side.
_PARTS: dict[str, tuple[str, ...]] = {
    "browInnerUp": ("Brow_Raise_Inner_{}", "browRaiseIn{}", "InnerBrowRaiser{}"),
    "cheekPuff": ("mouthCheekBlow{}",),
    "mouthRollUpper": ("Mouth_Roll_In_Upper_{}", "LipSuckUpper{}", "mouthUpperLipRollIn{}"),
    "mouthRollLower": ("Mouth_Roll_In_Lower_{}", "LipSuckLower{}", "mouthLowerLipRollIn{}"),
    "mouthFunnel": (
        *("Mouth_Funnel_Up_{}", "Mouth_Funnel_Down_{}"),
        *("LipFunnelUpper{}", "LipFunnelLower{}"),
    ),
    "mouthPucker": (
        *("Mouth_Pucker_Up_{}", "Mouth_Pucker_Down_{}", "LipPuckerUpper{}", "LipPuckerLower{}"),
        *("LipPucker{}", "MouthNarrow_{}"),
    ),
    "mouthLabiodental": ("mouthLowerLipBite{}",),
}
_QUARTERS = {  # {} is UL, UR, DL, DR, or LT, RT, LB, RB
    "mouthFunnel": ("mouthFunnel{}", "mouthLipsFunnel{}", "LipFunneler{}"),
    "mouthPucker": ("mouthLipsPurse{}",),
    "mouthClose": ("mouthLipsTogether{}",),
}
_MORE_PARTS: dict[str, tuple[str, ...]] = {
    "mouthFunnel": ("LipFunnelUpper", "LipFunnelLower", "MouthFunnelUpper", "MouthFunnelLower"),
    "mouthPucker": ("LipPuckerUpper", "LipPuckerLower", "MouthPuckerUpper", "MouthPuckerLower"),
    "mouthRollUpper": ("LipSuckLT", "LipSuckRT"),
    "mouthRollLower": ("LipSuckLB", "LipSuckRB"),
    "mouthShrugUpper": ("jawChinRaiseUL", "jawChinRaiseUR"),
    "mouthShrugLower": ("jawChinRaiseDL", "jawChinRaiseDR"),
    "mouthPressLeft": ("mouthPressUL", "mouthPressDL"),
    "mouthPressRight": ("mouthPressUR", "mouthPressDR"),
    "mouthSmileLeft": ("mouthCornerPullL", "MouthCornerSlantL"),
    "mouthSmileRight": ("mouthCornerPullR", "MouthCornerSlantR"),
    "mouthLeft": ("MouthUpperLeft", "MouthLowerLeft"),
    "mouthRight": ("MouthUpperRight", "MouthLowerRight"),
}
_AJAR = {"jawOpen": 0.02}
"""With which a viseme is a whole mouth, which shares a weight with others."""
_WIDE = _AJAR | both("mouthStretch")
_CC_VISEMES = {
    ("V_Open",): {"jawOpen": 0.6},
    ("V_Explosive", "Explosive", "B_M_P"): VISEME_SHAPES["PP"],
    ("V_Dental_Lip", "Dental_Lip", "F_V"): VISEME_SHAPES["FF"],
    ("V_Tight_O", "Tight_O"): VISEME_SHAPES["ou"],
    ("V_Tight", "W_OO"): VISEME_SHAPES["W"],
    ("V_Wide",): _WIDE,
    ("V_Affricate", "Affricate", "Ch_J"): VISEME_SHAPES["CH"],
    ("V_Lip_Open", "Lip_Open"): _AJAR | dict.fromkeys(both("mouthLowerDown", "mouthUpperUp"), 0.5),
    ("K_G_H_NG",): VISEME_SHAPES["kk"],
    ("S_Z",): VISEME_SHAPES["SS"],
    ("T_L_D_N",): VISEME_SHAPES["DD"],
}
AMONG_OTHERS: Mapping[str, Looks] = {
    "open": {"jawOpen": 0.6},
    "tight": VISEME_SHAPES["W"],
    "wide": _WIDE,
}
"""Character Creator's visemes without their V, which say nothing alone."""
# Action units by number and by Ekman's names; AU25 to 27 part the lips ever wider.
_FACS_SIDED = {
    ("AU2", "OuterBrowRaiser"): "browOuterUp",
    ("AU4", "BrowLowerer"): "browDown",
    ("AU5", "UpperLidRaiser"): "eyeWide",
    ("AU6", "CheekRaiser"): "cheekSquint",
    ("AU7", "LidTightener"): "eyeSquint",
    ("AU9", "NoseWrinkler"): "noseSneer",
    ("AU10", "UpperLipRaiser"): "mouthUpperUp",
    ("AU12", "LipCornerPuller"): "mouthSmile",
    ("AU14", "Dimpler"): "mouthDimple",
    ("AU15", "LipCornerDepressor"): "mouthFrown",
    ("AU16", "LowerLipDepressor"): "mouthLowerDown",
    ("AU20", "LipStretcher"): "mouthStretch",
    ("AU24", "LipPressor", "LipPresser"): "mouthPress",
    ("AU43", "EyesClosed"): "eyeBlink",
    ("AU45", "Blink"): "eyeBlink",
    ("AU46", "Wink"): "eyeBlink",
}
_FACS = {
    ("AU1", "InnerBrowRaiser"): {"browInnerUp": 1.0},
    ("AU17", "ChinRaiser", "ChinRaiserB"): {"mouthShrugLower": 1.0},
    ("ChinRaiserT", "ChinRaiserUpperLip"): {"mouthShrugUpper": 1.0},
    ("AU18", "LipPucker", "LipPuckerer"): {"mouthPucker": 1.0},
    ("AU22", "LipFunneler", "Funneler"): {"mouthFunnel": 1.0},
    ("AU25", "LipsPart"): dict.fromkeys(both("mouthLowerDown", "mouthUpperUp"), 0.5),
    ("AU26", "JawDrop"): {"jawOpen": 1.0},
    ("AU27", "MouthStretch"): {"jawOpen": 1.0},
    ("AU28", "LipSuck"): {"mouthRollLower": 1.0, "mouthRollUpper": 1.0},
    ("AU29", "JawThrust"): {"jawForward": 1.0},
    ("AU34", "CheekPuff"): {"cheekPuff": 1.0},
}
_OTHER: dict[tuple[str, ...], Looks] = {
    ("mouthOpen", "openMouth", "jawDown", "lowerJawDown"): {"jawOpen": 1.0},
    ("mouthOpenHalf_max",): {"jawOpen": 0.5},
    ("MouthClosed", "LipsToward", "LipsTogether", "MouthApeShape"): {"mouthClose": 1.0},
    ("jawFwd", "jawOut_max"): {"jawForward": 1.0},
    ("JawSidewaysLeft", "JawSlideLeft"): {"jawLeft": 1.0},
    ("JawSidewaysRight", "JawSlideRight"): {"jawRight": 1.0},
    ("LipSuckUpper", "UpperLipIn", "UpperLipSuck", "LipsUpperClose", "MouthUpperInside"): {
        "mouthRollUpper": 1.0
    },
    ("LipSuckLower", "LowerLipIn", "LowerLipSuck", "LipsLowerClose", "MouthLowerInside"): {
        "mouthRollLower": 1.0
    },
    ("MouthRaiserUpper", "ChinUpperRaise"): {"mouthShrugUpper": 1.0},
    ("MouthRaiserLower", "mouthLowerOut_max", "ChinLowerRaise"): {"mouthShrugLower": 1.0},
    ("mouthInflated_max", "Puff"): {"cheekPuff": 1.0},
    ("browsMidVert_max", "BrowsU_C"): {"browInnerUp": 1.0},
    ("eyesClosed", "eyesClose", "eyeClosed", "blinkBoth", "blinks"): both("eyeBlink"),
    ("eyesLookUp", "lookUp"): both("eyeLookUp"),
    ("eyesLookDown", "lookDown"): both("eyeLookDown"),
    ("eyesLookLeft", "lookLeft"): VRM_GAZE["lookLeft"],
    ("eyesLookRight", "lookRight"): VRM_GAZE["lookRight"],
    ("smile",): both("mouthSmile"),
    ("frown", "MouthSad", "mouthSmile_min"): both("mouthFrown"),
    ("pucker", "lipsPucker", "kiss", "MouthPout"): {"mouthPucker": 1.0},
    ("funnel", "lipsFunnel", "LipFunnel"): {"mouthFunnel": 1.0},
    ("tongueUp", "tongueTipUp", "TongueTipAlveolar"): {"tongueTipUp": 1.0},
    ("TongueTipInterdental",): {"tongueDental": 1.0},
    ("FclEyeClose", "まばたき"): both("eyeBlink"),
    ("FclEyeCloseL",): {"eyeBlinkLeft": 1.0},
    ("FclEyeCloseR",): {"eyeBlinkRight": 1.0},
    ("FclMthClose", "mouthClosed_max"): VISEME_SHAPES["PP"],
    ("mouthBite_max",): VISEME_SHAPES["FF"],
    ("mouthOpenO_max",): VISEME_SHAPES["oh"],
    ("mouthOpenTeethClosed_max",): VISEME_SHAPES["SS"],
    ("あ",): VISEME_SHAPES["aa"],
    ("い",): VISEME_SHAPES["ih"],
    ("う",): VISEME_SHAPES["ou"],
    ("え",): VISEME_SHAPES["E"],
    ("お",): VISEME_SHAPES["oh"],
    ("ん",): VISEME_SHAPES["PP"],
}


def known_names() -> Iterator[Row]:
    """Every spelling that is known.

    Yields
    ------
    Row
        Of two with the same words the first counts.
    """
    yield from _arkit()
    for name, own in OCULUS.items():
        yield f"viseme_{name}", "viseme", VISEME_SHAPES[own], False
    yield from _sided()
    yield from _parted()
    for names, looks in _CC_VISEMES.items():
        for name in names:
            yield name, "viseme", looks, False
    for number, (names, looks) in enumerate(_MICROSOFT):
        for name in names:
            yield f"{name}_{number:02}", "viseme", looks, False
            if "_" in name:
                yield name, "viseme", looks, False
    for names, own in _FACS_SIDED.items():
        for name in names:
            for spelling in _padded(name):
                yield spelling, "facs", both(own), False
                for side in SIDES:
                    yield f"{spelling}{side}", "facs", {f"{own}{side}": 1.0}, False
    for table, family in ((_FACS, "facs"), (_OTHER, "other")):
        for names, looks in table.items():
            for name in names:
                for spelling in _padded(name):
                    yield spelling, family, looks, False


def _arkit() -> Iterator[Row]:
    for name in ARKIT_NAMES:
        yield name, "arkit", {name: 1.0}, False
    pairs = [name.removesuffix("Left") for name in ARKIT_NAMES if name.endswith("Left")]
    for name in pairs:
        if name not in ("jaw", "mouth"):
            yield name, "arkit", both(name), False
    for name in _WHOLE_OF_TWO:
        for side in SIDES:
            yield f"{name}{side}", "arkit", {name: 1.0}, True


def _sided() -> Iterator[Row]:
    for own, patterns in _SIDED.items():
        for pattern in patterns:
            for side in SIDES:
                yield pattern.format(side), "cc", {f"{own}{side}": 1.0}, False
    for side, left, right in (("Left", "Out", "In"), ("Right", "In", "Out")):
        for pattern in ("Eye_{side}_Look_{way}", "eyeLook{way}{side}", "EyesLook{way}{side}"):
            for way, own in (("Left", left), ("Right", right)):
                name = pattern.format(side=side, way=way)
                yield name, "cc", {f"eyeLook{own}{side}": 1.0}, False
    for side in SIDES:
        yield f"Jaw_{side}", "cc", {f"jaw{side}": 1.0}, False
        yield f"Mouth_{side}", "cc", {f"mouth{side}": 1.0}, False


def _parted() -> Iterator[Row]:
    for own, patterns in _PARTS.items():
        for pattern in patterns:
            for side in SIDES:
                yield pattern.format(side), "cc", {own: 1.0}, True
    for own, patterns in _QUARTERS.items():
        for pattern in patterns:
            for quarter in ("UL", "UR", "DL", "DR", "LT", "RT", "LB", "RB"):
                yield pattern.format(quarter), "cc", {own: 1.0}, True
    for own, names in _MORE_PARTS.items():
        for name in names:
            yield name, "cc", {own: 1.0}, True


def _padded(name: str) -> tuple[str, ...]:
    """`AU6` is written `AU06` as well."""
    number = name.removeprefix("AU")
    return (name, f"AU{number:0>2}") if number.isdecimal() else (name,)
