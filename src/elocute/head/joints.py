"""Finds the joints of a head by the names that people give them."""

from __future__ import annotations

from elocute.errors import MotionError
from elocute.head.model import HeadModel
from elocute.numerics.input_checks import check_kind

# Elocute's and FLAME's words for the same joints.
_SAME = {
    "lefteye": "eyeleft",
    "leye": "eyeleft",
    "eyeballleft": "eyeleft",
    "lefteyeball": "eyeleft",
    "righteye": "eyeright",
    "reye": "eyeright",
    "eyeballright": "eyeright",
    "righteyeball": "eyeright",
}


def joint_index(head: HeadModel, joint: str) -> int:
    """The index of a joint by its name; `eyeLeft`, `eye_left` and `left_eye` are the same.

    The head of a skeleton without such a joint, as FLAME's, turns by its neck.

    Raises MotionError for a joint that the head lacks.
    """
    check_kind("joint", joint, str, ", ".join(head.joint_names), MotionError)
    if joint in head.joint_names:
        return head.joint_names.index(joint)
    plain = [_plain(name) for name in head.joint_names]
    if _plain(joint) in plain:
        return plain.index(_plain(joint))
    if _plain(joint) == "head" and "neck" in plain:
        return plain.index("neck")
    raise MotionError.about(
        f"joint {joint!r}",
        found=f"no such joint on head {head.name!r}",
        allowed=", ".join(head.joint_names) or "none: this head has no joints",
    )


def _plain(name: str) -> str:
    name = "".join(letter for letter in name.lower() if letter.isalnum())
    return _SAME.get(name, name)
