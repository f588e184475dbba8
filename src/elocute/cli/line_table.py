"""Tables of lines to be spoken: a CSV with a row for each take."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from elocute.errors import InputError
from elocute.files.delimited import DelimitedTable
from elocute.files.names import DEVICES
from elocute.files.reading import FileKind, read_text
from elocute.models.take_settings import TakeSettings
from elocute.numerics.frame_rates import frame_rate
from elocute.settings import settings_of
from elocute.speech.voices.settings import VoiceSettings

TABLE_FILE = FileKind("a CSV of lines", 50_000_000)
LINES_MAX = 100_000
MISSPELLED = 0.85
"""How like one of ours another column's name is that is taken for a slip."""
SETTINGS = {
    each.name: str(each.type)
    for each, _ in settings_of(TakeSettings)
    if each.name not in ("head", "mesh")
}
"""Settings of a take that a row may have, and their types; all takes of a table have one head."""
NUMBERS = [name for name, kind in SETTINGS.items() if kind in ("float", "int") and name != "fps"]
FILES = (".json", ".onnx")
COLUMNS = (
    *("id", "text", "audio", "language", "voice", "rate", "pitch", "action", "into"),
    *SETTINGS,
)
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}")


@dataclass(frozen=True)
class Line:
    """A row of a table: a take by its name, which is not a path.

    `text` is what is said, "" for a recording without a text. `audio` is a recording below the
    table's folder, "" where the text is spoken. `voice` speaks the text or says its language.
    `settings` are what is said of the take's settings, by name; an edit list lies below the table's
    folder. `action` is what the take's animation is called, `into` the file in the folder of the
    outputs that it is added to; "" leaves both to the command.
    """

    name: str
    text: str
    audio: str
    voice: VoiceSettings
    settings: dict[str, Any] = field(default_factory=dict)
    action: str = ""
    into: str = ""


@dataclass(frozen=True)
class UnusableLine:
    """A row that makes no take: its name, as far as it has one, and its fault in one line."""

    name: str
    fault: str


def read_lines(path: str | Path, voice: VoiceSettings) -> list[Line | UnusableLine]:
    """Read a table of lines, in the order of its rows; what is wrong with one row is told of that
    row alone.

    Commas, semicolons or tabs part its columns, which its first row names: `id`, `text` or `audio`
    or both, and any of `language`, `voice`, `rate`, `pitch`, `action`, `into` and `SETTINGS`. Other
    columns are left alone. An empty cell means what `voice` says.

    Raises
    ------
    InputError
        For another file, too many rows, and columns that are missing or misspelled.
    """
    path = Path(path)
    text = read_text(path, TABLE_FILE)
    lines: list[Line | UnusableLine] = []
    seen: dict[str, int] = {}
    try:
        table = DelimitedTable.of(text)
        _check_columns(path, table.names)
        for number, row in table.rows():
            if len(lines) >= LINES_MAX:
                raise InputError.about(path, found="too many rows", allowed=f"up to {LINES_MAX}")
            lines.append(_line(number, table, row, voice, seen))
    except csv.Error as error:
        raise InputError.about(
            path, found=f"not a CSV ({str(error)[:60]})", allowed=",".join(COLUMNS)
        ) from error
    if not lines:
        raise InputError.about(path, found="no rows", allowed="a row for each take")
    return lines


def _check_columns(path: Path, names: Sequence[str]) -> None:
    """Raise InputError for columns that are missing, there twice, or misspelled; others may be."""
    twice = [name for name in names if name in COLUMNS and names.count(name) > 1]
    meant = {
        name: near[0]
        for name in names
        if name not in COLUMNS and (near := get_close_matches(name, COLUMNS, 1, MISSPELLED))
    }
    wrong = next((name for name, near in meant.items() if near not in names), "")
    if twice or wrong or "id" not in names or not {"text", "audio"} & set(names):
        fault = f"column {(twice or [wrong])[0][:40]!r}" + " twice" * bool(twice)
        raise InputError.about(
            path,
            found=fault if twice or wrong else f"columns {', '.join(names)[:60] or 'missing'}",
            allowed=f"id, text or audio, and any of {', '.join(COLUMNS[3:])}",
            remedy=f"{wrong[:40]!r} may be {meant[wrong]!r}" if wrong and not twice else "",
        )


def _line(
    number: int,
    table: DelimitedTable,
    row: list[str],
    voice: VoiceSettings,
    seen: dict[str, int],
) -> Line | UnusableLine:
    cells = dict.fromkeys(COLUMNS, "") | dict(zip(table.names, row, strict=False))
    for column in NUMBERS:
        cells[column] = table.number_text(cells[column])
    name = cells["id"] or f"row {number}"
    try:
        if any(row[len(table.names) :]):
            raise InputError(f"{len(row)} cells; allowed: {len(table.names)}")
        _check_name(cells["id"])
        before = seen.setdefault(cells["id"].casefold(), number)
        if before != number:
            raise InputError(f"id of row {before} too; allowed: each id once")
        return _checked(cells, voice)
    except InputError as error:
        where = f"row {number}: " if cells["id"] else ""
        return UnusableLine(name[:100], f"{where}{error}")


def _check_name(name: str) -> None:
    if NAME.fullmatch(name) is None or name.endswith(".") or DEVICES.fullmatch(name):
        raise InputError.about(
            "id", found=repr(name[:60]), allowed="a plain name of letters, digits and _ - ."
        )


def _checked(cells: dict[str, str], voice: VoiceSettings) -> Line:
    if not cells["text"] and not cells["audio"]:
        raise InputError("no text and no audio; allowed: one of them, or both")
    for column in SETTINGS:
        cell = cells[column]
        if column != "edits" and (cell.lower().endswith(FILES) or "/" in cell or "\\" in cell):
            raise InputError.about(
                column, found=repr(cell[:60]), allowed="a name, a number or a mix, no file"
            )
    return Line(
        cells["id"],
        cells["text"],
        cells["audio"],
        VoiceSettings(
            cells["language"] or voice.language,
            cells["voice"] or voice.voice,
            _whole(cells["rate"], "rate", voice.words_per_minute),
            _whole(cells["pitch"], "pitch", voice.pitch),
        ),
        {column: _setting(column, cells[column]) for column in SETTINGS if cells[column]},
        cells["action"],
        _one_file(cells["into"]),
    )


def _one_file(cell: str) -> str:
    """The name of a .glb, or ""."""
    name, suffix = cell[:-4], cell[-4:].lower()
    if cell and (suffix != ".glb" or NAME.fullmatch(name) is None or DEVICES.fullmatch(cell)):
        raise InputError.about(
            "into", found=repr(cell[:60]), allowed="the plain name of a .glb, such as hero_all.glb"
        )
    return cell


def _setting(column: str, cell: str) -> Any:
    if column == "fps":
        return frame_rate(cell)
    if column in NUMBERS:
        return _number(cell, column) if SETTINGS[column] == "float" else _whole(cell, column, 0)
    return cell


def _whole(cell: str, what: str, default: int) -> int:
    if not cell:
        return default
    if not (cell.isascii() and cell.isdecimal() and len(cell) < 6):
        raise InputError.about(what, found=repr(cell[:40]), allowed="a whole number")
    return int(cell)


def _number(cell: str, what: str) -> float:
    try:
        return float(cell)
    except ValueError:
        raise InputError.about(what, found=repr(cell[:40]), allowed="a number") from None
