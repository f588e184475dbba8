"""Finds neck, head, jaw and eyes among the joints of a file by the names that rigs use."""

from __future__ import annotations

import re
from collections.abc import Iterable

_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
_SIDES = {"l": "Left", "left": "Left", "r": "Right", "right": "Right"}
# Words that rigs put around the name of a joint: mixamorig:Head, CC_Base_Head, J_Bip_C_Head,
# Bip001 Head, DEF-head, head_jnt.
_AROUND = frozenset(
    (
        *("mixamorig", "mixamo", "cc", "base", "j", "bip", "adj", "c", "m", "x", "b", "bn", "sk"),
        *("def", "org", "mch", "bone", "joint", "jnt", "bind", "skin", "rig", "armature"),
        *("character", "avatar", "facial", "valve", "biped"),
    )
)
_NAMES: dict[str, tuple[tuple[str, ...], ...]] = {
    "neck": (("neck",), ("neck", "twist"), ("neck", "lower"), ("lower", "neck")),
    "head": (("head",),),
    "jaw": (("jaw",), ("jaw", "root"), ("lower", "jaw"), ("jaw", "lower"), ("mandible",)),
    "eye": (("eye",), ("face", "eye"), ("eyeball",), ("eye", "ball")),
}
VRM_BONES = {
    "neck": "neck",
    "head": "head",
    "jaw": "jaw",
    "leftEye": "eyeLeft",
    "rightEye": "eyeRight",
}
"""What a VRM calls them itself."""


def joint_of(name: str) -> str | None:
    """Which of the built-in head's joints a joint is.

    Parameters
    ----------
    name : str
        As the file has it.

    Returns
    -------
    str or None
        "neck", "head", "jaw", "eyeLeft", "eyeRight"; None for others.
    """
    words = [word.lower() for word in _WORDS.findall(name[:200])]
    sides = {_SIDES[word] for word in words if word in _SIDES}
    rest = _without_rig(word for word in words if word not in _SIDES)
    for joint, known in _NAMES.items():
        if rest in known and (len(sides) == 1) == (joint == "eye") and len(sides) < 2:
            return joint + "".join(sides)
    return None


def _without_rig(words: Iterable[str]) -> tuple[str, ...]:
    kept = list(words)
    while kept and kept[0] in _AROUND:
        kept = kept[1:]
    while kept and kept[-1] in _AROUND:
        kept = kept[:-1]
    return tuple(kept)
