"""Reading study.toml: every section and field checked, errors told by their line."""

from __future__ import annotations

import hashlib
import re
import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from elocute.errors import StudyError
from elocute.files.json_records import finite_number
from elocute.files.reading import FileKind, read_bytes
from elocute.settings import types_of
from elocute.study.design.design import (
    ITEMS_MAX,
    Checked,
    Comparisons,
    Condition,
    Design,
    Stimuli,
    StimulusSound,
)

SECTIONS: dict[str, type] = {
    name: kind
    for name, (kind, _) in types_of(Design).items()
    if isinstance(kind, type) and issubclass(kind, Checked)
}
"""Beside [[conditions]]."""
DESIGN_FILE = FileKind("a study (study.toml)", 1_000_000, StudyError)


def read_design(path: str | Path) -> Design:
    """Read the file of a study.

    Parameters
    ----------
    path : str or Path
        study.toml, or the folder that it is in.

    Returns
    -------
    Design

    Raises
    ------
    StudyError
        For a file that cannot be read, naming line, section and field, what was found and what is
        allowed.
    """
    path = Path(path)
    if path.is_dir():
        path = path / "study.toml"
    data = read_bytes(path, DESIGN_FILE)
    try:
        text = data.decode("utf-8-sig")
        tables = tomllib.loads(text)
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as problem:
        raise DESIGN_FILE.unusable(path, str(problem)[:200]) from None
    return _Reader(path, text).design(tables, hashlib.sha256(data).hexdigest())


class _Reader:
    """Makes sections of tables; knows the text for the lines of errors."""

    def __init__(self, path: Path, text: str) -> None:
        self._path = path
        self._lines = text.splitlines()

    def design(self, tables: Mapping[str, Any], sha256: str) -> Design:
        known = [*SECTIONS, "conditions"]
        for name in tables:
            if name not in known:
                raise self._error(0, f"[{name}]", "unknown", ", ".join(known), named=name)
        for name in ("study", "stimuli", "conditions"):
            if name not in tables:
                raise self._error(0, f"[{name}]", "missing", f"a section [{name}]")
        sections = {
            name: self._section(name, SECTIONS[name], tables[name])
            for name in SECTIONS
            if name in tables
        }
        try:
            return Design(
                conditions=self._conditions(tables["conditions"]),
                path=self._path,
                sha256=sha256,
                **sections,
            )
        except StudyError as error:
            if str(error).startswith(str(self._path)):
                raise
            raise self._placed(str(error)) from None

    def _conditions(self, entries: object) -> tuple[Condition, ...]:
        if not isinstance(entries, list) or not 0 < len(entries) <= ITEMS_MAX:
            allowed = f"1 to {ITEMS_MAX} tables [[conditions]]"
            raise self._error(0, "[[conditions]]", "none", allowed, named="conditions")
        return tuple(
            self._section("conditions", Condition, each, place)
            for place, each in enumerate(entries)
        )

    def _section(self, name: str, kind: type, table: object, place: int = 0) -> Any:
        title = "[[conditions]]" if name == "conditions" else f"[{name}]"
        start = self._start(name, place)
        if not isinstance(table, dict):
            raise self._error(start, title, "no table", f"a section {title}")
        known = {each.name: each for each in fields(kind)}
        for key in table:
            if key not in known:
                allowed = ", ".join(known)
                raise self._error(self._line(start, key), title, f"unknown `{key}`", allowed)
        for key, each in known.items():
            if each.default is MISSING and each.default_factory is MISSING and key not in table:
                raise self._error(start, title, f"no `{key}`", f"a line {key} = …")
        try:
            return kind(**{key: _value(kind, key, value) for key, value in table.items()})
        except StudyError as error:
            named = re.search(r"`(\w+)`", str(error))
            line = self._line(start, named.group(1) if named else "")
            raise StudyError(f"{self._at(line)} {title} {error}") from None

    def _start(self, name: str, place: int) -> int:
        """The line where a section begins, from 1; 0 where it is not found."""
        heading = re.compile(rf"\s*\[\[?\s*{re.escape(name)}\s*\]")
        lines = [at for at, line in enumerate(self._lines, 1) if heading.match(line)]
        return lines[place] if place < len(lines) else 0

    def _line(self, start: int, key: str) -> int:
        """The line of a field of the section that begins at a line."""
        for at, line in enumerate(self._lines[start:], start + 1):
            if re.match(r"\s*\[", line) and not re.match(r"\s*\[+[^\]=]*[,\"']", line):
                break
            if key and re.match(rf"\s*{re.escape(key)}\s*[.=]", line):
                return at
        return start

    def _placed(self, message: str) -> StudyError:
        """An error of sections that do not fit, at the section and field that it names."""
        section = re.match(r"\[+(\w+)\]+(?: `(\w+)`)?", message)
        start = self._start(section.group(1), 0) if section else 0
        line = self._line(start, section.group(2) or "") if section else 0
        return StudyError(f"{self._at(line)} {message}")

    def _error(
        self, line: int, title: str, found: str, allowed: str, named: str = ""
    ) -> StudyError:
        line = line or (self._start(named, 0) if named else 0)
        return StudyError.about(f"{self._at(line)} {title}", found=found, allowed=allowed)

    def _at(self, line: int) -> str:
        return f"{self._path} line {line}:" if line else f"{self._path}:"


def _value(kind: type, key: str, value: Any) -> Any:
    """A value of TOML as the dataclass has it. Raises StudyError."""
    if kind is Stimuli and key == "sounds":
        return _sounds(value)
    if kind is Comparisons and key == "pairs":
        return _pairs(value)
    if key in ("identities", "views", "languages"):
        return _texts(value, f"`{key}`")
    if isinstance(value, list):
        return tuple(value)
    if isinstance(value, int) and not isinstance(value, bool) and types_of(kind)[key][0] is float:
        return float(value)
    return value


def _texts(value: object, about: str) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
        raise StudyError.about(about, found=repr(value)[:60], allowed="a list of texts")
    return tuple(value)


def _pairs(value: object) -> tuple[tuple[str, str], ...]:
    pairs: list[Any] = value if isinstance(value, list) else [None]
    if len(pairs) > ITEMS_MAX or not all(
        isinstance(pair, list) and len(pair) == 2 and all(isinstance(each, str) for each in pair)
        for pair in pairs
    ):
        raise StudyError.about("`pairs`", found=repr(value)[:60], allowed='[["rules", "voca"], …]')
    return tuple((one, other) for one, other in pairs)


SOUND_FIELDS = tuple(each.name for each in fields(StimulusSound))


def _sounds(value: object) -> tuple[StimulusSound, ...]:
    """Files, or tables with a file and words."""
    if not isinstance(value, list) or len(value) > ITEMS_MAX:
        raise StudyError.about("`sounds`", found=repr(value)[:60], allowed="a list of files")
    return tuple(_sound(each) for each in value)


def _sound(entry: object) -> StimulusSound:
    table = {"file": entry} if isinstance(entry, str) else entry
    if not isinstance(table, dict) or not isinstance(table.get("file"), str) or not table["file"]:
        raise StudyError.about(
            "`sounds`", found=repr(entry)[:60], allowed='"one.wav" or {file = "one.wav", …}'
        )
    unknown = sorted(set(table) - set(SOUND_FIELDS))
    if unknown:
        raise StudyError.about(
            "`sounds`", found=f"unknown {unknown[0]!r}", allowed=", ".join(SOUND_FIELDS)
        )
    choices = _texts(table.get("choices", []), "`choices`")
    texts = {key: table.get(key, "") for key in ("seen", "word")}
    for key, text in texts.items():
        if not isinstance(text, str):
            raise StudyError.about(f"`sounds` {key}", found=repr(text)[:60], allowed="a text")
    times = {key: finite_number(table.get(key, 0.0)) for key in ("start_s", "end_s")}
    for key, number in times.items():
        if number is None:
            raise StudyError.about(
                f"`sounds` {key}", found=repr(table[key])[:60], allowed="a number of seconds"
            )
    known = {key: number for key, number in times.items() if number is not None}
    name = table.get("name", sound_name(table["file"]))
    return StimulusSound(
        name,
        table["file"],
        texts["seen"],
        texts["word"],
        choices,
        known["start_s"],
        known["end_s"],
    )


def sound_name(file: str) -> str:
    """A file's name as the name of a stimulus: small letters, and - for what is not allowed."""
    stem = Path(file).stem if "*" not in file else file.replace("*", "all")
    return re.sub(r"[^a-z0-9_-]+", "-", stem.lower()).strip("-")[:64]
