"""Edit lists: a closed JSON schema, read into plain items.

    {"elocute": "edits", "version": 1, "edits": [{"edit": "amplitude", …}, …]}

A key that is not known is an error that names the nearest, with its path in the file.
"""

from __future__ import annotations

import difflib
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from elocute.errors import MotionError
from elocute.files.json_records import finite_number, read_json
from elocute.files.reading import FileKind, path_of
from elocute.motion.edits.amplitude import AMPLITUDE_MAX, SHAPES
from elocute.motion.edits.blinks import PER_MINUTE_MAX
from elocute.motion.edits.closures import CLOSED_BLEND_S
from elocute.motion.edits.edit_items import (
    BLEND_S,
    AmplitudeItem,
    BlinksItem,
    ClosedItem,
    CurveItem,
    FaceItem,
    GazeItem,
    HeadItem,
    Item,
    Keys,
    LoopItem,
    Moment,
    MoodItem,
    OffsetItem,
    RetimeItem,
    Span,
    StyleItem,
)
from elocute.motion.edits.keyframes import WAYS
from elocute.motion.edits.timing import LOOP_BLEND_S, OFFSET_MAX_S
from elocute.one_line_repr import brief

MARK, VERSION = "edits", 1
EDITS_FILE = FileKind("an edit list (.json)", 20_000_000, MotionError)
EDITS_MAX = 1000
KEYS_MAX = 100_000
FACES_MAX = 1000
TIME_MAX_S = 1e6
WEIGHT_MAX = 3.0
DEGREES_MAX = 180.0
SEED_MAX = 2**31 - 1
TEXT_MAX = 200
END = re.compile(r"end(?:\s*-\s*(\d{1,6}(?:\.\d{1,9})?))?", re.ASCII)
TIME_ALLOWED = 'seconds from 0, "end" or "end-0.5"'


@dataclass(frozen=True)
class EditList:
    """Edits of a take, in the order of their file.

    Parameters
    ----------
    items : tuple
        Each with its own settings; `edits[0]` of the file is `items[0]`.
    source : str
        The file, for messages.
    """

    items: tuple[Item, ...]
    source: str = "edits"

    def __repr__(self) -> str:
        return f"EditList({len(self.items)} edits of {self.source})"


def read_edits(path: str | Path) -> EditList:
    """Read an edit list.

    Parameters
    ----------
    path : str or Path
        A JSON file of version 1.

    Returns
    -------
    EditList

    Raises
    ------
    MotionError
        For anything else; it names the file, the place in it, and what is allowed there.
    """
    file = path_of(path, MotionError)
    return _list_of(read_json(file, EDITS_FILE), str(file))


def edits_of(given: EditList | str | Path | Mapping[str, Any]) -> EditList:
    """An edit list as a caller gives it: the list, its file, or what such a file holds.

    Raises MotionError as `read_edits` does.
    """
    if isinstance(given, EditList):
        return given
    if isinstance(given, str | os.PathLike):
        return read_edits(given)
    return _list_of(given, "edits")


def _list_of(record: Any, source: str) -> EditList:
    top = _Object(record, source, "", ("elocute", "version", "edits"))
    if top.take("elocute") != MARK:
        top.refuse("elocute", found=brief(top.take("elocute")), allowed=f'"{MARK}"')
    if type(top.take("version")) is not int or top.take("version") != VERSION:
        top.refuse(
            "version",
            found=brief(top.take("version")),
            allowed=str(VERSION),
            remedy="a newer Elocute may read it",
        )
    rows = _rows(top, "edits", EDITS_MAX)
    return EditList(tuple(_item(row, source, place) for place, row in enumerate(rows)), source)


def _item(given: Any, source: str, place: int) -> Item:
    where = f"edits[{place}]"
    if not isinstance(given, Mapping):
        raise _error(
            source, where, found=brief(given), allowed='an object such as {"edit": "loop"}'
        )
    kind = given.get("edit")
    if not isinstance(kind, str) or kind not in KINDS:
        found = "nothing" if "edit" not in given else brief(kind)
        raise _error(
            source,
            f"{where}.edit",
            found=found,
            allowed=", ".join(KINDS),
            remedy=_near(kind, KINDS),
        )
    keys, read = KINDS[kind]
    return read(_Object(given, source, where, ("edit", *keys)))


class _Object:
    """A JSON object at a place of the file, with a closed set of keys."""

    def __init__(self, given: Any, source: str, where: str, keys: Sequence[str]) -> None:
        self._source, self._where = source, where
        if not isinstance(given, Mapping):
            raise _error(source, where, found=brief(given), allowed="a JSON object")
        self._given, self.keys = given, keys
        for key in given:
            if key not in keys:
                raise _error(
                    source,
                    where,
                    found=f"key {brief(key)}",
                    allowed=", ".join(keys),
                    remedy=_near(key, keys),
                )

    def __contains__(self, key: str) -> bool:
        return key in self._given

    def take(self, key: str, default: Any = None) -> Any:
        """The value of a key."""
        return self._given.get(key, default)

    def part(self, key: str, keys: Sequence[str]) -> _Object:
        """The object that is the value of a key."""
        return _Object(self.take(key), self._source, self._path(key), keys)

    def refuse(self, key: str, *, found: str, allowed: str, remedy: str = "") -> NoReturn:
        """Raise MotionError about the value of a key."""
        raise _error(self._source, self._path(key), found=found, allowed=allowed, remedy=remedy)

    def _path(self, key: str) -> str:
        return f"{self._where}.{key}" if self._where else key

    def number(self, key: str, low: float, high: float, default: float | None = None) -> float:
        """A number within bounds; required without a default."""
        if default is not None and key not in self:
            return default
        return self.checked_number(key, self.take(key), low, high)

    def checked_number(self, key: str, given: Any, low: float, high: float) -> float:
        """A value below a key as a number within bounds."""
        number = finite_number(given)
        if number is None or not low <= number <= high:
            found = "nothing" if given is None else brief(given)
            self.refuse(key, found=found, allowed=f"a number, {low:g} to {high:g}")
        return number

    def choice(self, key: str, choices: Sequence[str]) -> str:
        """One of these texts; the first is the default."""
        value = self.take(key, choices[0])
        if not isinstance(value, str) or value not in choices:
            self.refuse(
                key, found=brief(value), allowed=", ".join(choices), remedy=_near(value, choices)
            )
        return value

    def text(self, key: str) -> str:
        """A short text."""
        given = self.take(key)
        if not isinstance(given, str) or not 0 < len(given) <= TEXT_MAX:
            found = "nothing" if given is None else brief(given)
            self.refuse(key, found=found, allowed=f"a text of up to {TEXT_MAX} letters")
        return given

    def moment(self, key: str, given: Any) -> Moment:
        """A time below a key."""
        seconds = finite_number(given)
        if seconds is not None and 0 <= seconds <= TIME_MAX_S:
            return Moment(seconds)
        match = END.fullmatch(given.strip()) if isinstance(given, str) else None
        if match is None:
            found = "nothing" if given is None else brief(given)
            self.refuse(key, found=found, allowed=TIME_ALLOWED)
        return Moment(-float(match[1] or 0), from_end=True)

    def span(self, *, blend_s: float = BLEND_S, required: bool = False) -> Span:
        """`from`, `to` and `blend`."""
        ends = [
            self.moment(key, self.take(key)) if required or key in self else None
            for key in ("from", "to")
        ]
        start, stop = ends
        if start and stop and start.from_end == stop.from_end and start.seconds >= stop.seconds:
            found = f"{brief(self.take('from'))} to {brief(self.take('to'))}"
            self.refuse("to", found=found, allowed="a time after `from`")
        blend = self.take("blend", blend_s)
        parts = blend if isinstance(blend, list | tuple) and len(blend) == 2 else (blend, blend)
        come, go = (finite_number(part) for part in parts)
        if come is None or go is None or not (0 <= come <= 60 and 0 <= go <= 60):
            self.refuse("blend", found=brief(blend), allowed="seconds, 0 to 60, or two of them")
        return Span(start, stop, (come, go))

    def keys_of(self, key: str, width: int, most: float) -> Keys:
        """Keyframes [[time, value or values], …]; their times rise."""
        shape = "value" if width == 1 else ", ".join("xyz"[:width]).join("[]")
        read: list[tuple[Moment, tuple[float, ...]]] = []
        for number, row in enumerate(_rows(self, key, KEYS_MAX)):
            place = f"{key}[{number}]"
            if not isinstance(row, list | tuple) or len(row) != 2:
                self.refuse(place, found=brief(row), allowed=f"[time, {shape}]")
            values = row[1] if width > 1 else [row[1]]
            if not isinstance(values, list | tuple) or len(values) != width:
                self.refuse(place, found=brief(row), allowed=f"[time, {shape}]")
            moment = self.moment(place, row[0])
            self._check_rising(place, [when for when, _ in read[-1:]], moment)
            read.append((moment, tuple(self.checked_number(place, v, -most, most) for v in values)))
        if not read:
            self.refuse(key, found="no keys", allowed=f"[[time, {shape}], …]")
        return tuple(read)

    def _check_rising(self, place: str, before: Sequence[Moment], moment: Moment) -> None:
        for last in before:
            if last.from_end and not moment.from_end:
                self.refuse(place, found="a time after one from the end", allowed="rising times")
            if last.from_end == moment.from_end and moment.seconds <= last.seconds:
                found = f"{moment.seconds:g} s after {last.seconds:g} s"
                self.refuse(place, found=found, allowed="rising times")


def _rows(about: _Object, key: str, most: int) -> Sequence[Any]:
    rows = about.take(key)
    if not isinstance(rows, list | tuple):
        found = "nothing" if rows is None else brief(rows)
        about.refuse(key, found=found, allowed="a list")
    if len(rows) > most:
        about.refuse(key, found=f"{len(rows)} entries", allowed=f"up to {most}")
    return rows


def _error(source: str, where: str, *, found: str, allowed: str, remedy: str = "") -> MotionError:
    subject = f"{source}: {where}" if where else source
    return MotionError.about(subject, found=found, allowed=allowed, remedy=remedy)


def _near(name: Any, known: Sequence[str] | Mapping[str, Any]) -> str:
    near = difflib.get_close_matches(str(name)[:40], list(known), 1, 0.5)
    return f"did you mean {near[0]!r}?" if near else ""


def _style(item: _Object) -> Item:
    return StyleItem(item.text("style"), item.span())


def _mood(item: _Object) -> Item:
    return MoodItem(item.text("mood"), item.span(blend_s=0.3))


def _offset(item: _Object) -> Item:
    return OffsetItem(item.number("seconds", -OFFSET_MAX_S, OFFSET_MAX_S))


def _amplitude(item: _Object) -> Item:
    part = item.part("regions", tuple(SHAPES))
    regions = {name: part.number(name, 0, AMPLITUDE_MAX) for name in SHAPES if name in part}
    if not regions:
        item.refuse("regions", found="no region", allowed=", ".join(SHAPES))
    return AmplitudeItem(regions, item.span())


def _curve(item: _Object) -> Item:
    return CurveItem(
        item.text("curve"),
        item.keys_of("keys", 1, WEIGHT_MAX),
        item.choice("mode", ("replace", "add")),
        item.choice("between", WAYS),
        item.choice("contacts", ("keep", "free")),
        item.span(),
    )


def _closed(item: _Object) -> Item:
    return ClosedItem(item.span(blend_s=CLOSED_BLEND_S, required=True))


def _head(item: _Object) -> Item:
    return HeadItem(
        item.keys_of("keys", 3, DEGREES_MAX),
        item.choice("mode", ("add", "replace")),
        item.choice("between", WAYS),
        item.span(),
    )


def _gaze(item: _Object) -> Item:
    return GazeItem(item.keys_of("keys", 2, DEGREES_MAX), item.choice("between", WAYS), item.span())


def _blinks(item: _Object) -> Item:
    def moments(key: str) -> tuple[Moment, ...]:
        rows = _rows(item, key, KEYS_MAX) if key in item else ()
        return tuple(item.moment(f"{key}[{n}]", row) for n, row in enumerate(rows))

    if not any(key in item for key in item.keys[1:]):
        item.refuse("add", found="nothing", allowed="any of " + ", ".join(item.keys[1:]))
    return BlinksItem(
        None if item.take("remove") == "all" else moments("remove"),
        moments("add"),
        item.number("per_minute", 0, PER_MINUTE_MAX, 0.0),
        int(item.number("seed", 0, SEED_MAX, 0.0)),
    )


def _face(item: _Object) -> Item:
    keys: list[tuple[Moment, str]] = []
    for number, row in enumerate(_rows(item, "keys", FACES_MAX)):
        place = f"keys[{number}]"
        pair = isinstance(row, list | tuple) and len(row) == 2
        name = str(row[1]) if pair and type(row[1]) in (str, int) else ""
        if not 0 < len(name) <= TEXT_MAX or name.lower().endswith(".json"):
            item.refuse(place, found=brief(row), allowed="[time, a face's name or a seed]")
        keys.append((item.moment(place, row[0]), name))
    if not keys:
        item.refuse("keys", found="no keys", allowed='[[time, "ada"], …]')
    return FaceItem(tuple(keys))


def _retime(item: _Object) -> Item:
    pairs = item.keys_of("times", 1, TIME_MAX_S)
    if len(pairs) < 2:
        item.refuse("times", found="one pair", allowed="two or more [old s, new s]")
    return RetimeItem(tuple((moment, new) for moment, (new,) in pairs))


def _loop(item: _Object) -> Item:
    return LoopItem(item.number("blend", 0.02, 10, LOOP_BLEND_S))


_SPAN = ("from", "to", "blend")
KINDS: dict[str, tuple[tuple[str, ...], Callable[[_Object], Item]]] = {
    "style": (("style", *_SPAN), _style),
    "mood": (("mood", *_SPAN), _mood),
    "offset": (("seconds",), _offset),
    "amplitude": (("regions", *_SPAN), _amplitude),
    "curve": (("curve", "keys", "mode", "between", "contacts", *_SPAN), _curve),
    "closed": (_SPAN, _closed),
    "head": (("keys", "mode", "between", *_SPAN), _head),
    "gaze": (("keys", "between", *_SPAN), _gaze),
    "blinks": (("add", "remove", "per_minute", "seed"), _blinks),
    "face": (("keys",), _face),
    "retime": (("times",), _retime),
    "loop": (("blend",), _loop),
}
"""Kinds of edits in the order in which they are applied; each with its keys and reader."""
