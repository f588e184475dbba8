"""What a morph target does, by its name: ARKit's, visemes, Character Creator's, FACS and others.

A name is read as words: `head_blendshape.eyeBlink_L`, `Eye Blink Left` and `eyeBlinkLeft` are one.
What it does is told as weights of the built-in head's curves at weight one of the target.
"""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache

from elocute.head.preset_shapes import VRM_GAZE, VRM_LIDS, VRM_MOUTH
from elocute.head.viseme_shapes import VISEME_SHAPES
from elocute.motion.curves import ARKIT_NAMES

SIDES = ("Left", "Right")
COMMON_SHARE, COMMON_MIN = 0.6, 5
"""So many of a mesh's names begin with a word that is no part of the shape's name."""
_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+|[^\x00-\x7f]+")
_SIDE_WORDS = {"l": "left", "r": "right", "left": "left", "right": "right"}
_NUMBERED = re.compile(r"^[A-Za-z]{0,2}\d{2}$")  # A25_Jaw_Open


@dataclass(frozen=True)
class Meaning:
    """What a name stands for.

    Attributes
    ----------
    family : str
        Whose name it is: "arkit", "viseme", "vrm", "cc", "facs", "other".
    looks : dict of str to float
        Weights of the built-in head's curves.
    part : bool
        Whether it is one of several targets that make up the shape together.
    """

    family: str
    looks: dict[str, float]
    part: bool = False

    @property
    def key(self) -> str:
        """The same for all that do the same."""
        return ", ".join(f"{name} {weight:g}" for name, weight in sorted(self.looks.items()))


def meanings_of(names: Sequence[str]) -> list[Meaning | None]:
    """What the morph targets of one mesh do.

    Parameters
    ----------
    names : sequence of str
        All of the mesh's, since a word that most begin with is left out, and single letters are
        visemes only among others.

    Returns
    -------
    list of Meaning or None
        None for a name that is not known.
    """
    common = _common_words(names)
    found = [_known(name, common) for name in names]
    bare = [_bare_viseme(name, common) for name in names]
    if sum(each is not None for each in bare) >= 3:
        found = [one or other for one, other in zip(found, bare, strict=True)]
    return found


def vrm_meaning(preset: str) -> Meaning | None:
    """What an expression of a VRM does, by the name of its preset, of version 0 or 1.

    Parameters
    ----------
    preset : str
        Such as "aa" or "blink_l".

    Returns
    -------
    Meaning or None
        None for moods and what the user named.
    """
    looks = _VRM.get(preset.replace("_", "").lower())
    return None if looks is None else Meaning("vrm", looks)


def nearest_name(name: str) -> str | None:
    """A known name that a name may be meant for.

    Parameters
    ----------
    name : str
        Not known.

    Returns
    -------
    str or None
        None where nothing is near.
    """
    key = "".join(_words(name.rsplit(".", 1)[-1]))[:80]
    near = difflib.get_close_matches(key, _table(), n=1, cutoff=0.75)
    return _table()[near[0]][1] if near else None


def _words(name: str) -> list[str]:
    """The words of a name, sides written out."""
    words: list[str] = [word.lower() for word in _WORDS.findall(name)]
    return [_SIDE_WORDS.get(word, word) for word in words]


def _common_words(names: Sequence[str]) -> frozenset[str]:
    """Words that most names begin with and no shape's name does."""
    least, common = max(COMMON_MIN, COMMON_SHARE * len(names)), set[str]()
    rest = [_words(name) for name in names]
    while True:
        first = Counter(words[0] for words in rest if words)
        more = {w for w, count in first.items() if count >= least and w not in _beginnings()}
        if not more:
            return frozenset(common)
        common |= more
        rest = [words[1:] if words[:1] and words[0] in more else words for words in rest]


def _known(name: str, common: frozenset[str]) -> Meaning | None:
    for words in _readings(name, common):
        for key in _keys(words):
            if key in _table():
                return _table()[key][0]
    return None


def _readings(name: str, common: frozenset[str]) -> Iterable[list[str]]:
    """A name as words, with less and less of its beginning."""
    parts = re.split(r"[.:|/]", name)
    for start in range(len(parts)):  # `blendShape1.jawOpen`, `Wolf3D_Head.mouth.open`
        words = _words(" ".join(parts[start:]))
        yield words
        pieces = re.split(r"[_\-\s]+", parts[start])
        if len(pieces) > 1 and _NUMBERED.match(pieces[0]):
            yield _words(" ".join([*pieces[1:], *parts[start + 1 :]]))
        while words and words[0] in common:
            words = words[1:]
            yield words


def _keys(words: list[str]) -> Iterable[str]:
    """The key of a name, and that with its side at the end."""
    yield "".join(words)
    sides = [word for word in words if word in ("left", "right")]
    if len(set(sides)) == 1:
        yield "".join([*(word for word in words if word not in ("left", "right")), sides[0]])


def _bare_viseme(name: str, common: frozenset[str]) -> Meaning | None:
    """A viseme whose name is a letter or two, as `E` or `PP`."""
    for words in _readings(name, common):
        while words and words[0] in ("fcl", "mth", "v", "vrc", "lip", "lips", "mouth"):
            words = words[1:]
        looks = _BARE.get("".join(words))
        if looks is not None:
            return Meaning("viseme", looks)
    return None


def _both(*names: str) -> dict[str, float]:
    return {f"{name}{side}": 1.0 for name in names for side in SIDES}


_OCULUS = {
    **{name: name for name in ("sil", "PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR", "aa")},
    "E": "E",
    "I": "ih",
    "ih": "ih",
    "O": "oh",
    "oh": "oh",
    "U": "ou",
    "ou": "ou",
}
_BARE = {
    **{name.lower(): VISEME_SHAPES[own] for name, own in _OCULUS.items()},
    "a": VISEME_SHAPES["aa"],
    "ee": VISEME_SHAPES["E"],
}
_VRM: dict[str, dict[str, float]] = {
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

# Character Creator (CC3 and CC4 Extended), where its words are not ARKit's. {} is a side.
_CC_SIDED = {
    "Brow_Drop_{}": "browDown",
    "Brow_Raise_Outer_{}": "browOuterUp",
    "Eye_{}_Look_Up": "eyeLookUp",
    "Eye_{}_Look_Down": "eyeLookDown",
    "Cheek_Raise_{}": "cheekSquint",
    "Mouth_Up_Upper_{}": "mouthUpperUp",
    "Mouth_Upper_Up_{}": "mouthUpperUp",
    "Mouth_Down_Lower_{}": "mouthLowerDown",
    "Mouth_Lower_Down_{}": "mouthLowerDown",
}
_CC_PARTS = {
    "browInnerUp": ("Brow_Raise_Inner_{}",),
    "mouthRollUpper": ("Mouth_Roll_In_Upper_{}",),
    "mouthRollLower": ("Mouth_Roll_In_Lower_{}",),
    "mouthFunnel": ("Mouth_Funnel_Up_{}", "Mouth_Funnel_Down_{}"),
    "mouthPucker": ("Mouth_Pucker_Up_{}", "Mouth_Pucker_Down_{}"),
}
_CC_VISEMES = {
    "V_Open": {"jawOpen": 0.6},
    "V_Explosive": VISEME_SHAPES["PP"],
    "V_Dental_Lip": VISEME_SHAPES["FF"],
    "V_Tight_O": VISEME_SHAPES["ou"],
    "V_Tight": VISEME_SHAPES["W"],
    "V_Wide": {**_both("mouthStretch")},
    "V_Affricate": VISEME_SHAPES["CH"],
    "V_Lip_Open": dict.fromkeys(_both("mouthLowerDown", "mouthUpperUp"), 0.5),
    "B_M_P": VISEME_SHAPES["PP"],
    "Ch_J": VISEME_SHAPES["CH"],
    "F_V": VISEME_SHAPES["FF"],
    "K_G_H_NG": VISEME_SHAPES["kk"],
    "S_Z": VISEME_SHAPES["SS"],
    "T_L_D_N": VISEME_SHAPES["DD"],
    "W_OO": VISEME_SHAPES["W"],
}
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
    ("AU24", "LipPressor"): "mouthPress",
    ("AU43", "EyesClosed"): "eyeBlink",
    ("AU45", "Blink"): "eyeBlink",
    ("AU46", "Wink"): "eyeBlink",
}
_FACS = {
    ("AU1", "InnerBrowRaiser"): {"browInnerUp": 1.0},
    ("AU17", "ChinRaiser"): {"mouthShrugLower": 1.0},
    ("AU18", "LipPucker", "LipPuckerer"): {"mouthPucker": 1.0},
    ("AU22", "LipFunneler"): {"mouthFunnel": 1.0},
    ("AU25", "LipsPart"): dict.fromkeys(_both("mouthLowerDown", "mouthUpperUp"), 0.5),
    ("AU26", "JawDrop"): {"jawOpen": 1.0},
    ("AU27", "MouthStretch"): {"jawOpen": 1.0},
    ("AU28", "LipSuck"): {"mouthRollLower": 1.0, "mouthRollUpper": 1.0},
    ("AU29", "JawThrust"): {"jawForward": 1.0},
    ("AU34", "CheekPuff"): {"cheekPuff": 1.0},
}
_OTHER: dict[tuple[str, ...], dict[str, float]] = {
    ("mouthOpen", "openMouth", "jawDown", "lowerJawDown"): {"jawOpen": 1.0},
    ("eyesClosed", "eyesClose", "blinkBoth", "blinks"): _both("eyeBlink"),
    ("eyesLookUp", "lookUp"): _both("eyeLookUp"),
    ("eyesLookDown", "lookDown"): _both("eyeLookDown"),
    ("eyesLookLeft", "lookLeft"): VRM_GAZE["lookLeft"],
    ("eyesLookRight", "lookRight"): VRM_GAZE["lookRight"],
    ("smile",): _both("mouthSmile"),
    ("frown",): _both("mouthFrown"),
    ("pucker", "lipsPucker", "kiss"): {"mouthPucker": 1.0},
    ("funnel", "lipsFunnel"): {"mouthFunnel": 1.0},
    ("tongueUp", "tongueTipUp"): {"tongueTipUp": 1.0},
    ("FclEyeClose", "まばたき"): _both("eyeBlink"),
    ("FclEyeCloseL",): {"eyeBlinkLeft": 1.0},
    ("FclEyeCloseR",): {"eyeBlinkRight": 1.0},
    ("あ",): VISEME_SHAPES["aa"],
    ("い",): VISEME_SHAPES["ih"],
    ("う",): VISEME_SHAPES["ou"],
    ("え",): VISEME_SHAPES["E"],
    ("お",): VISEME_SHAPES["oh"],
}


@cache
def _table() -> dict[str, tuple[Meaning, str]]:
    """By key: what it does, and how its owner spells it. What comes first wins."""
    found: dict[str, tuple[Meaning, str]] = {}

    def add(spelling: str, family: str, looks: dict[str, float], part: bool = False) -> None:
        key = "".join(_words(spelling))
        found.setdefault(key, (Meaning(family, looks, part), spelling))

    for name in ARKIT_NAMES:
        add(name, "arkit", {name: 1.0})
    for name in dict.fromkeys(_stems()):
        add(name, "arkit", _both(name))
    for name in _WHOLE_OF_TWO:
        for side in SIDES:
            add(f"{name}{side}", "arkit", {name: 1.0}, part=True)
    for name, own in _OCULUS.items():
        add(f"viseme_{name}", "viseme", VISEME_SHAPES[own])
    _add_creator(add)
    for names, own in _FACS_SIDED.items():
        for name in map(_padded, names):
            for spelling in name:
                add(spelling, "facs", _both(own))
                for side in SIDES:
                    add(f"{spelling}{side}", "facs", {f"{own}{side}": 1.0})
    for table, family in ((_FACS, "facs"), (_OTHER, "other")):
        for names, looks in table.items():
            for name in names:
                for spelling in _padded(name):
                    add(spelling, family, looks)
    for side in SIDES:
        add(f"blink{side}", "other", {f"eyeBlink{side}": 1.0})
        add(f"smile{side}", "other", {f"mouthSmile{side}": 1.0})
    return found


def _add_creator(add) -> None:
    for pattern, own in _CC_SIDED.items():
        for side in SIDES:
            add(pattern.format(side), "cc", {f"{own}{side}": 1.0})
    for side, left, right in (("Left", "Out", "In"), ("Right", "In", "Out")):
        add(f"Eye_{side}_Look_Left", "cc", {f"eyeLook{left}{side}": 1.0})
        add(f"Eye_{side}_Look_Right", "cc", {f"eyeLook{right}{side}": 1.0})
    for own, patterns in _CC_PARTS.items():
        for pattern in patterns:
            for side in SIDES:
                add(pattern.format(side), "cc", {own: 1.0}, part=True)
    for name, way in (("Jaw", "jaw"), ("Mouth", "mouth")):
        for side in SIDES:
            add(f"{name}_{side}", "cc", {f"{way}{side}": 1.0})
    for name, looks in _CC_VISEMES.items():
        add(name, "viseme", looks)


def _padded(name: str) -> tuple[str, ...]:
    """`AU6` is written `AU06` as well."""
    number = name.removeprefix("AU")
    return (name, f"AU{number:0>2}") if number.isdecimal() else (name,)


def _stems() -> list[str]:
    """ARKit's names of shapes that have two sides, without their side."""
    pairs = [name.removesuffix("Left") for name in ARKIT_NAMES if name.endswith("Left")]
    return [name for name in pairs if name not in ("jaw", "mouth")]


@cache
def _beginnings() -> frozenset[str]:
    """First words of the names that are known."""
    return frozenset(_words(spelling)[0] for _, spelling in _table().values())
