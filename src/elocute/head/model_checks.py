"""Checks of a head's arrays, before anything indexes them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NoReturn

import numpy as np

from elocute.errors import HeadError
from elocute.head.character import Character
from elocute.head.looks.look import Look
from elocute.numerics.input_checks import NUMBERS_MAX

LENGTH_MAX = 1e6
"""Beyond any unit of a head's lengths; squares and sums of such numbers still fit a float32."""
NAME_MAX, NOTICE_MAX, NAMES_MAX = 200, 100_000, 10_000
_MAY_BE_EMPTY = ("landmarks", "outer_corners", "inner_corners", "mirror")
PLACES = (
    "landmarks",
    "lip_rings",
    "outer_lip_upper",
    "outer_lip_lower",
    "inner_lip_upper",
    "inner_lip_lower",
    "outer_corners",
    "inner_corners",
    "mirror",
)
_NUMBERS = (
    "template",
    "uv",
    "identity_basis",
    "expression_basis",
    "joint_positions",
    "joint_identity_basis",
    "skin_weights",
    "occlusion",
    "tone_basis",
    "trait_basis",
    "pose_basis",
    "joint_regressor",
)
_WHOLE = ("quads", "uv_quads", *PLACES, "material", "vertex_color")
_AXES = {
    **dict.fromkeys(("template", "quads", "uv", "uv_quads", "joint_positions", "skin_weights"), 2),
    **dict.fromkeys(("lip_rings", "vertex_color", "trait_basis", "joint_regressor"), 2),
    **dict.fromkeys(
        ("identity_basis", "expression_basis", "joint_identity_basis", "pose_basis"), 3
    ),
}
"""Axes where they are not one."""
_REGIONS = ("regions", dict)
_NAMES = ("expression_names", "joint_names", "material_names")


def refuse(head: Mapping[str, Any], found: str, allowed: str = "") -> NoReturn:
    """Raise HeadError about a head with these fields."""
    name = head["name"][:NAME_MAX] if isinstance(head["name"], str) else "?"
    raise HeadError.about(f"head {name!r}", found=found, allowed=allowed)


def check_head(head: Mapping[str, Any]) -> None:
    """Raise HeadError where the fields of a head do not fit each other."""
    if head["look"] is not None and not isinstance(head["look"], Look):
        refuse(head, f"a look of {type(head['look']).__name__}", "a Look or None")
    if head["character"] is not None and not isinstance(head["character"], Character):
        refuse(head, f"a character of {type(head['character']).__name__}", "a Character or None")
    _check_kinds(head)
    _check_shapes(head)
    _check_values(head)


def _check_kinds(head: Mapping[str, Any]) -> None:
    for field_name, most in (("name", NAME_MAX), ("notice", NOTICE_MAX)):
        text = head[field_name]
        if not isinstance(text, str) or len(text) > most:
            refuse(head, f"{field_name} that is not text", f"up to {most} characters")
    for field_name, kind in (*((name, tuple) for name in (*_NAMES, "joint_parents")), _REGIONS):
        if not isinstance(head[field_name], kind):
            refuse(head, f"{field_name} is not a {kind.__name__}")
    if not all(isinstance(name, str) for name in head["regions"]):
        refuse(head, "a region whose name is not text")
    for field_name in _NAMES:
        names = head[field_name]
        texts = all(isinstance(name, str) and len(name) <= NAME_MAX for name in names)
        if not texts or len(names) > NAMES_MAX or len(set(names)) != len(names):
            refuse(head, f"{field_name} with an unusable or repeated name", "texts, each once")
    regions = {f"region {name[:40]}": values for name, values in head["regions"].items()}
    kinds = [(name, head[name], "f") for name in _NUMBERS]
    kinds += [(name, head[name], "iu") for name in _WHOLE]
    for name, values, allowed in (*kinds, *((name, v, "iu") for name, v in regions.items())):
        if not isinstance(values, np.ndarray) or values.dtype.kind not in allowed:
            actual = values.dtype if isinstance(values, np.ndarray) else type(values).__name__
            refuse(
                head,
                f"{name} of {actual}",
                "floating-point numbers" if allowed == "f" else "whole numbers",
            )
        if values.size > NUMBERS_MAX:
            refuse(head, f"{name} of {values.size} numbers", f"up to {NUMBERS_MAX}")


def _check_shapes(head: Mapping[str, Any]) -> None:
    for field_name in (*_NUMBERS, *_WHOLE):
        values = head[field_name]
        if values.ndim != _AXES.get(field_name, 1):
            refuse(head, f"{field_name} is {values.shape}", f"{_AXES.get(field_name, 1)} axes")
    vertex, face = len(head["template"]), len(head["quads"])
    if not vertex:
        refuse(head, "no vertices", "one or more")
    joint, expression = len(head["joint_names"]), len(head["expression_names"])
    identity = len(head["identity_basis"])
    expected: dict[str, tuple[int, ...]] = {
        "template": (vertex, 3),
        "quads": (face, 4),
        "uv": (len(head["uv"]), 2),
        "uv_quads": (face, 4),
        "identity_basis": (identity, vertex, 3),
        "expression_basis": (expression, vertex, 3),
        "joint_positions": (joint, 3),
        "joint_identity_basis": (identity, joint, 3),
        "skin_weights": (vertex, joint),
        "landmarks": (68,),
        "inner_lip_lower": head["inner_lip_upper"].shape,
        "outer_corners": (2,),
        "inner_corners": (2,),
        "material": (face,),
        "vertex_color": (vertex, 3),
        "occlusion": (vertex,),
        "mirror": (vertex,),
    }
    if len(head["pose_basis"]):
        expected["pose_basis"] = (9 * (joint - 1), vertex, 3)
    if len(head["joint_regressor"]):
        expected["joint_regressor"] = (joint, vertex)
    for field_name, shape in expected.items():
        actual = head[field_name].shape
        if actual != shape and not (actual == (0,) and field_name in _MAY_BE_EMPTY):
            refuse(head, f"{field_name} is {actual}", str(shape))
    if len(head["joint_parents"]) != joint:
        refuse(head, f"{len(head['joint_parents'])} parents for {joint} joints")


def _check_values(head: Mapping[str, Any]) -> None:
    for field_name in _NUMBERS:
        values = head[field_name]
        low, high = values.min(initial=0), values.max(initial=0)  # NaN where one is NaN
        if not (low >= -LENGTH_MAX and high <= LENGTH_MAX):
            finite = bool(np.isfinite(values).all())
            found = (
                f"{field_name} of {max(-low, high):g}" if finite else f"{field_name} is not finite"
            )
            refuse(head, found, f"up to {LENGTH_MAX:g}")
    places = [(name, head[name], len(head["template"])) for name in ("quads", *PLACES)]
    places += [
        (f"region {name[:40]}", values, len(head["template"]))
        for name, values in head["regions"].items()
    ]
    places.append(("uv_quads", head["uv_quads"], len(head["uv"])))
    places.append(("material", head["material"], len(head["material_names"])))
    for field_name, values, top in places:
        if values.size and (values.min() < 0 or values.max() >= top):
            refuse(head, f"{field_name} points past {top} entries")
    for index, parent in enumerate(head["joint_parents"]):
        whole = isinstance(parent, int | np.integer) and not isinstance(parent, bool)
        if not whole or not -1 <= parent < index:
            refuse(head, f"joint {index} that does not follow its parent", "parents come first")
