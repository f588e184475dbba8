"""Reads what somebody says that shapes of a character do: `hero.names.json` beside `hero.glb`.

A JSON object: names of morph targets, each with a name that is known (`"jawOpen"`, `"viseme_PP"`),
with weights of ARKit's curves, or with null for a shape that is to be left alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from elocute.adoption.characters.shape_names import Meaning, meanings_of, nearest_name
from elocute.errors import HeadError
from elocute.files.json_records import finite_number, read_record
from elocute.files.reading import FileKind
from elocute.motion.curves import ARKIT_NAMES
from elocute.one_line_repr import brief

SUFFIX = ".names.json"
NAMES_KIND = FileKind(
    "a JSON object of names of shapes", 1_000_000, HeadError, 'as {"Mund_auf": "jawOpen"}'
)
GIVEN = "given"
"""The family of a name that somebody explained."""
GivenNames = Mapping[str, Meaning]


def names_path(character: Path) -> Path:
    """Where the names of a character's file lie."""
    return character.with_suffix(SUFFIX)


def read_given_names(character: Path) -> GivenNames:
    """What is said about a character's shapes, by their names; {} where nothing is.

    character: its file, beside which the names lie. Raises HeadError for a file that cannot be read
    or holds anything but names and what they do.
    """
    return given_names(stored_names(character), names_path(character))


def stored_names(character: Path) -> dict[str, Any]:
    """The record of the file itself, unchecked; {} where there is none. Raises HeadError."""
    path = names_path(character)
    if path.is_symlink():
        raise NAMES_KIND.unusable(path, "a link")
    return read_record(path, NAMES_KIND) if path.exists() else {}


def given_names(record: Mapping[str, Any], subject: str | Path) -> GivenNames:
    """What a record says, checked. subject: what errors are about. Raises HeadError."""
    return {name: Meaning(GIVEN, _looks(name, does, subject)) for name, does in record.items()}


def meanings_with(names: Sequence[str], given: GivenNames) -> list[Meaning | None]:
    """As `meanings_of`, but for names that somebody explained."""
    return [given.get(name, one) for name, one in zip(names, meanings_of(names), strict=True)]


def _looks(name: str, does: Any, subject: str | Path) -> dict[str, float]:
    if does is None:
        return {}
    if isinstance(does, str):
        (meaning,) = meanings_of([does])
        if meaning is not None:
            return meaning.looks
    if isinstance(does, dict) and does and all(map(_is_weight, does.items())):
        return {curve: float(weight) for curve, weight in does.items()}
    near = nearest_name(does) if isinstance(does, str) else None
    raise HeadError.about(
        subject,
        found=f"{brief(does)} for {brief(name)}",
        allowed="a known name, weights of ARKit's curves above 0 and at most 1, or null",
        remedy=f"perhaps {near}" if near else NAMES_KIND.remedy,
    )


def _is_weight(item: tuple[str, Any]) -> bool:
    curve, weight = item[0], finite_number(item[1])
    return curve in ARKIT_NAMES and weight is not None and 0 < weight <= 1
