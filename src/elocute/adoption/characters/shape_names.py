"""Reads from the name of a morph target what it does, in the spellings that files come with.

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

from elocute.adoption.characters.shape_sets import (
    AMONG_OTHERS,
    BARE,
    BARE_VOWELS,
    NUMBERED,
    RHUBARB,
    VRM,
    known_names,
)
from elocute.head.viseme_shapes import VISEME_SHAPES

COMMON_SHARE, COMMON_MIN = 0.6, 5
"""So many of a mesh's names begin with a word that is no part of the shape's name."""
_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+|[^\x00-\x7f]+")
_SIDE_WORDS = {"l": "left", "r": "right", "left": "left", "right": "right"}
_COPY = re.compile(r"(\.\d{3})+$")
"""What Blender adds to a name that is taken."""
_BEFORE = re.compile(
    r"^(?:[A-Za-z]{2}_){0,2}[A-Za-z]{0,2}\d{2,3}[_\s-]"  # A25_Jaw_Open, AK_25_JawOpen, AA_VI_10_aa
    r"|^.*(?:e?CTRL_?(?:expressions_|VSM)?|facs_(?:bs|jnt|ctrl)_|PHM|VSM|Expressions_|__)"
    r"|^.*(?=Fcl_)"
)
_AFTER = re.compile(r"_(?:max|div2|HD\d?)$")
_NUMBER = re.compile(r"^(?:viseme|vis)s?[_\s-]*(?:id)?[_\s-]*(\d{1,2})$", re.IGNORECASE)
_MOUTH, _LIPS = ("mouth", "jaw", "tongue", "viseme", "phoneme", "vowel"), ("lip", "lips", "smile")
SHORT = 4
"""Letters of a name that may be a viseme's, beside others that are."""


@dataclass(frozen=True)
class Meaning:
    """What a name stands for."""

    family: str  # whose name it is: "arkit", "viseme", "vrm", "cc", "facs", "other"
    looks: dict[str, float]  # weights of the built-in head's curves
    part: bool = False  # whether it is one of several targets that make up the shape together

    @property
    def key(self) -> str:
        """The same for all that do the same."""
        return ", ".join(f"{name} {weight:g}" for name, weight in sorted(self.looks.items()))


def meanings_of(names: Sequence[str]) -> list[Meaning | None]:
    """What the morph targets of one mesh do; None for a name that is not known.

    names: all of the mesh's, since a word that most begin with is left out, and single letters are
    visemes only among others.
    """
    common = _common_words(names)
    found = [_known(name, common) for name in names]
    bare = _bare_visemes(names, common)
    if sum(each is not None and each.looks in _ASIDE for each in found) == 1:
        # `mouth_L` beside no `mouth_R` is an l
        found = [
            other if one is not None and one.looks in _ASIDE and other is not None else one
            for one, other in zip(found, bare, strict=True)
        ]
    for given in (bare, _numbered_visemes(names), _among_others(names, found)):
        found = [one or other for one, other in zip(found, given, strict=True)]
    return found


def like_a_mouth(name: str, visemes: bool) -> bool:
    """Whether a name that is not known looks like one of a mouth's; VRoid's whole faces and teeth
    do not.

    visemes: whether others of its mesh are visemes, so that a few letters may be one, too.
    """
    if "Fcl_" in name:
        return False
    letters = _COPY.sub("", name)
    of_mouth = any(word.startswith(_MOUTH) or word in _LIPS for word in words_of(letters))
    return of_mouth or (visemes and 0 < len(letters) <= SHORT)


def vrm_meaning(preset: str) -> Meaning | None:
    """What an expression of a VRM does, by the name of its preset, of version 0 or 1, such as "aa"
    or "blink_l"; None for moods and what the user named."""
    looks = VRM.get(preset.replace("_", "").lower())
    return None if looks is None else Meaning("vrm", looks)


def nearest_name(name: str) -> str | None:
    """A known name that an unknown one may be meant for; None where nothing is near."""
    key = "".join(words_of(name.rsplit(".", 1)[-1]))[:80]
    near = difflib.get_close_matches(key, _table(), n=1, cutoff=0.75)
    return _table()[near[0]][1] if near else None


def words_of(name: str) -> list[str]:
    """The words of a name, in small letters and with sides written out."""
    words: list[str] = [word.lower() for word in _WORDS.findall(name)]
    return [_SIDE_WORDS.get(word, word) for word in words]


def _common_words(names: Sequence[str]) -> frozenset[str]:
    """Words that most names begin with and no shape's name does."""
    least, common = max(COMMON_MIN, COMMON_SHARE * len(names)), set[str]()
    rest = [words_of(name) for name in names]
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
    """A name as words, with less and less of its beginning and its end."""
    name = _COPY.sub("", name)
    whole = [name, _BEFORE.sub("", name)]
    for spelling in dict.fromkeys([*whole, *(_AFTER.sub("", each) for each in whole)]):
        parts = re.split(r"[.:|/]", spelling)
        for start in range(len(parts)):  # `blendShape1.jawOpen`, `Wolf3D_Head.mouth.open`
            rest = " ".join(parts[start:])
            words = words_of(rest)
            yield words
            if start:
                yield words_of(_BEFORE.sub("", rest))
            while words and words[0] in common:
                words = words[1:]
                yield words


def _keys(words: list[str]) -> Iterable[str]:
    """The key of a name, and that with its side at the end."""
    yield "".join(words)
    sides = [word for word in words if word in ("left", "right")]
    if len(set(sides)) == 1:
        yield "".join([*(word for word in words if word not in ("left", "right")), sides[0]])


def _bare_visemes(names: Sequence[str], common: frozenset[str]) -> list[Meaning | None]:
    """Visemes whose name is a letter or a few, as `E`, `PP` or `MBP`; None where they are few."""
    letters = [_letters(name, common) for name in names]
    table = RHUBARB if set("abcdef") <= set(letters) else BARE
    if {"eh", "e", "uh"} & set(letters):  # of English charts: as in see; VRM's is that of bed
        table = {**table, "ee": VISEME_SHAPES["ih"], "eee": VISEME_SHAPES["ih"]}
    known = {each for each in letters if each in table}
    if len(known) < 3 or not known & BARE_VOWELS:
        return [None] * len(names)
    return [Meaning("viseme", table[each]) if each in known else None for each in letters]


def _letters(name: str, common: frozenset[str]) -> str:
    """What is left of a name that may be a viseme's."""
    for words in _readings(name, common):
        while len(words) > 1 and words[0] in _ABOUT_VISEMES:
            words = words[1:]
        key = "".join({"left": "l", "right": "r"}.get(word, word) for word in words)
        if key in BARE or key in RHUBARB:
            return key
    return ""


_ASIDE = ({"mouthLeft": 1.0}, {"mouthRight": 1.0})
_ABOUT_VISEMES = ("fcl", "mth", "v", "vrc", "lip", "lips", "mouth")
_ABOUT_VISEMES += ("viseme", "visemes", "phoneme", "phonemes", "rhubarb", "vowel")


def _among_others(names: Sequence[str], found: list[Meaning | None]) -> list[Meaning | None]:
    """Words that are visemes beside the rest of their set: Character Creator's without a V."""
    if sum(each is not None and each.family == "viseme" for each in found) < 3:
        return [None] * len(names)
    looks = [AMONG_OTHERS.get("".join(words_of(_COPY.sub("", name)))) for name in names]
    return [None if each is None else Meaning("viseme", each) for each in looks]


def _numbered_visemes(names: Sequence[str]) -> list[Meaning | None]:
    """Microsoft's visemes by their numbers, where there are those above the Oculus set's."""
    found = [_NUMBER.match(_COPY.sub("", name)) for name in names]
    numbers = [int(each[1]) if each else -1 for each in found]
    if not set(range(1, len(NUMBERED))) <= set(numbers):
        return [None] * len(names)
    return [
        Meaning("viseme", NUMBERED[number]) if 0 <= number < len(NUMBERED) else None
        for number in numbers
    ]


@cache
def _table() -> dict[str, tuple[Meaning, str]]:
    """By key: what it does, and how its owner spells it. What comes first wins."""
    found: dict[str, tuple[Meaning, str]] = {}
    for spelling, family, looks, part in known_names():
        found.setdefault("".join(words_of(spelling)), (Meaning(family, looks, part), spelling))
    return found


@cache
def _beginnings() -> frozenset[str]:
    """First words of the names that are known."""
    return frozenset(words_of(spelling)[0] for _, spelling in _table().values())
