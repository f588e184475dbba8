"""Tables of lines to be spoken: a CSV with a row for each take."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass
from pathlib import Path

from elocute.audio.voice_settings import VoiceSettings
from elocute.errors import InputError
from elocute.files.reading import read_text

BYTES_MAX = 50_000_000
LINES_MAX = 100_000
COLUMNS = (
    *("id", "text", "audio", "language", "voice", "rate", "pitch"),
    *("style", "identity", "strength", "life", "mood", "edits"),
)
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}")
# Names that Windows keeps for devices, whatever follows their first dot.
DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.I)


@dataclass(frozen=True)
class Line:
    """A row of a table.

    Parameters
    ----------
    name : str
        The name of its take, no path.
    text : str
        What is said; "" for a recording without a text.
    audio : str
        A recording below the table's folder; "" where the text is spoken.
    voice : VoiceSettings
        The voice that speaks it, or the language of the text.
    style, identity : str
        "" for what the command says.
    strength : float or None
        None for what the command says.
    life, mood : str
        "" for what the command says.
    edits : str
        An edit list below the table's folder; "" for what the command says.
    """

    name: str
    text: str
    audio: str
    voice: VoiceSettings
    style: str
    identity: str
    strength: float | None
    life: str
    mood: str
    edits: str = ""


@dataclass(frozen=True)
class UnusableLine:
    """A row that makes no take, and why.

    Parameters
    ----------
    name : str
        What it is called, as far as it has a name.
    fault : str
        In one line.
    """

    name: str
    fault: str


def read_lines(path: str | Path, voice: VoiceSettings) -> list[Line | UnusableLine]:
    """Read a table of lines.

    Parameters
    ----------
    path : str or Path
        A CSV in UTF-8 whose first row names its columns: `id`, `text` or `audio` or both, and any
        of `language`, `voice`, `rate`, `pitch`, `style`, `identity`,
        `strength`, `life`, `mood` and `edits`.
    voice : VoiceSettings
        What an empty cell means.

    Returns
    -------
    list of Line or UnusableLine
        In the order of the rows; what is wrong with one row is told of that row alone.

    Raises
    ------
    InputError
        For another file, too many rows, or columns with other names.
    """
    path = Path(path)
    text = read_text(path, max_bytes=BYTES_MAX, allowed="a CSV of lines")
    found: list[Line | UnusableLine] = []
    seen: dict[str, int] = {}
    try:
        rows = csv.reader(io.StringIO(text, newline=""))
        names = [name.strip().lower() for name in next(rows, [])]
        _check_columns(path, names)
        for number, row in enumerate(rows, 2):
            if not any(cell.strip() for cell in row):
                continue
            if len(found) >= LINES_MAX:
                raise InputError.about(path, found="too many rows", allowed=f"up to {LINES_MAX}")
            found.append(_line(number, names, row, voice, seen))
    except csv.Error as error:
        raise InputError.about(
            path, found=f"not a CSV ({str(error)[:60]})", allowed=",".join(COLUMNS)
        ) from error
    if not found:
        raise InputError.about(path, found="no rows", allowed="a row for each take")
    return found


def _check_columns(path: Path, names: list[str]) -> None:
    strange = [name for name in names if name not in COLUMNS]
    twice = [name for name in names if names.count(name) > 1]
    missing = "id" not in names or not {"text", "audio"} & set(names)
    if strange or twice or missing:
        told = f"column {(strange or twice)[0][:40]!r}" if strange or twice else "columns missing"
        raise InputError.about(
            path,
            found=told + (" twice" if twice and not strange else ""),
            allowed=f"id, text or audio, and any of {', '.join(COLUMNS[3:])}",
        )


def _line(
    number: int, names: list[str], row: list[str], voice: VoiceSettings, seen: dict[str, int]
) -> Line | UnusableLine:
    cells = dict.fromkeys(COLUMNS, "")
    cells |= {name: cell.strip() for name, cell in zip(names, row, strict=False)}
    name = cells["id"] or f"row {number}"
    try:
        if len(row) > len(names):
            raise InputError(f"{len(row)} cells; allowed: {len(names)}")
        _check_name(cells["id"])
        before = seen.setdefault(cells["id"].casefold(), number)
        if before != number:
            raise InputError(f"id of row {before} too; allowed: each id once")
        return _checked(cells, voice)
    except InputError as error:
        return UnusableLine(name[:100], f"row {number}: {error}")


def _check_name(name: str) -> None:
    if NAME.fullmatch(name) is None or name.endswith(".") or DEVICES.fullmatch(name):
        raise InputError.about(
            "id", found=repr(name[:60]), allowed="a plain name of letters, digits and _ - ."
        )


def _checked(cells: dict[str, str], voice: VoiceSettings) -> Line:
    if not cells["text"] and not cells["audio"]:
        raise InputError("no text and no audio; allowed: one of them, or both")
    for name in ("style", "identity"):
        if cells[name].lower().endswith(".json") or "/" in cells[name] or "\\" in cells[name]:
            raise InputError.about(
                name, found=repr(cells[name][:60]), allowed="a name or a mix, no file"
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
        cells["style"],
        cells["identity"],
        _number(cells["strength"], "strength"),
        cells["life"],
        cells["mood"],
        cells["edits"],
    )


def _whole(cell: str, what: str, default: int) -> int:
    if not cell:
        return default
    if not (cell.isascii() and cell.isdecimal() and len(cell) < 6):
        raise InputError.about(what, found=repr(cell[:40]), allowed="a whole number")
    return int(cell)


def _number(cell: str, what: str) -> float | None:
    if not cell:
        return None
    try:
        return float(cell)
    except ValueError:
        raise InputError.about(what, found=repr(cell[:40]), allowed="a number") from None
