"""Reads times of phones and words from CSV and CTM tables."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable

from elocute.errors import InputError
from elocute.files.delimited import DelimitedTable
from elocute.speech.phone_symbols import visemes_of
from elocute.speech.times.elan import BEGINS, ENDS, elan_table, tier_columns
from elocute.speech.times.labels import LABELS_MAX, Label, Labels, clock_seconds
from elocute.speech.times.tier_choice import TierChoice, check_one_speaker

HEAD_MAX = 4000
_CTM_LINE = re.compile(r"\S+\s+\S+\s+[\d.]+\s+[\d.]+\s+\S")
COLUMNS = "start_s,end_s,phone, start_s,end_s,word, or MFA's Begin,End,Label,Type,Speaker"
CTM = "lines of recording, channel, start, duration and label"
# Names of columns as aligners, Praat, pandas and people write them; others are left alone.
_STARTS = (
    "start_s",
    "start",
    "begin",
    "start_time",
    "onset",
    "xmin",
    "tmin",
    "begin_s",
    "start_ms",
    *BEGINS,
)
_ENDS = ("end_s", "end", "stop", "end_time", "xmax", "tmax", "stop_s", "end_ms", "offset", *ENDS)
_LENGTHS = ("duration_s", "duration", "dur", "length", "duration_ms")
_PHONES = ("phone", "phoneme", "phones", "segment")
_WORDS = ("word", "token", "words")
_VISEMES = ("viseme", "visemes", "viseme_id", "visemeid")
_LABELS = (*_PHONES, *_WORDS, *_VISEMES, "label", "text", "value", "name", "annotation")
_TIERS = ("type", "tier", "tier_name")


def has_columns(text: str) -> bool:
    """Whether a text is a table whose first line names its columns."""
    if elan_table(text):
        return True
    first = text.lstrip().partition("\n")[0]
    if first.startswith(";;") or _CTM_LINE.match(first):
        return False
    if "," in first:
        return True
    names = DelimitedTable.of(text[:HEAD_MAX]).names
    return len(names) > 2 and any(name in names for name in _STARTS)


def parse_csv(text: str, choice: TierChoice, sorted_out: Callable[[list[Label]], Labels]) -> Labels:
    """Phones or words of a table with a first row of names.

    Its columns are start, end or duration, and label; also a tier (MFA's Type) and a speaker, of
    which `choice` says what is wanted. `sorted_out` says whether labels are phones or words where
    no name does. Raises InputError for another table, naming the row and the column.
    """
    tiers: dict[str, list[Label]] = {}
    speakers: dict[str, None] = {}
    wanted = choice.speaker.strip().lower()
    try:
        table = elan_table(text) or DelimitedTable.of(text)
        start, end, length, kind = map(_column(table.names), (_STARTS, _ENDS, _LENGTHS, _LABELS))
        tier, speaker = map(_column(table.names), (_TIERS, ("speaker", "participant")))
        columns = [] if tier else tier_columns(table.names)
        kind = columns[0] if columns else kind
        if not start or not kind or not (end or length):
            shown = ",".join(table.names[:20])[:80] or "missing"
            raise InputError.about(f"first row {shown}", found="no known names", allowed=COLUMNS)
        for number, row in table.rows():
            _count(number)
            cells = dict(zip(table.names, row, strict=False))
            begun = _seconds(table, cells, start, number)
            until = _seconds(table, cells, end or length, number)
            until = until if end else begun + until
            if until < begun or kind not in cells:
                shown = table.delimiter.join(row[:4])[:60]
                raise InputError.about(
                    f"row {number}", found=shown, allowed=f"0 <= start <= end; {COLUMNS}"
                )
            said_by = cells.get(speaker, "")
            if wanted and said_by.lower() != wanted:
                continue
            speakers[said_by] = None
            for each in columns or [kind]:
                if cells.get(each) or not columns:
                    tiers.setdefault(cells.get(tier, each), []).append((begun, until, cells[each]))
    except csv.Error as error:
        raise InputError(f"not a CSV ({str(error)[:60]}); allowed: {COLUMNS}") from error
    check_one_speaker([*speakers])
    labels = TierChoice(choice.tier).labels([*tiers.items()], sorted_out)
    if kind in _VISEMES:
        found = [*labels.phones, *labels.words]
        return Labels(phones=found, alphabet=visemes_of(text for _, _, text in found))
    return labels


def _column(names: tuple[str, ...]) -> Callable[[tuple[str, ...]], str]:
    """Finds the first of some names among those of a table; "" where there is none."""
    return lambda known: next((name for name in known if name in names), "")


def _seconds(table: DelimitedTable, cells: dict[str, str], column: str, number: int) -> float:
    cell = cells.get(column, "")
    value = clock_seconds(cell)
    if value is None:
        value = _number(table.number_text(cell))
    if value is None or value < 0:
        raise InputError.about(
            f"row {number}, column {column}",
            found=repr(cell[:40]),
            allowed=f"a time from 0; {COLUMNS}",
        )
    return value / 1000 if column.endswith(("_ms", "_msec")) and ":" not in cell else value


def parse_ctm(text: str, stem: str = "") -> list[Label]:
    """Labels of a CTM file: those of the recording `stem` where it holds several.

    Raises InputError naming the line.
    """
    recordings: dict[str, list[Label]] = {}
    for number, line in enumerate(text.splitlines(), 1):
        fields = line.split()
        if not fields or line.startswith((";;", "#")):
            continue
        _count(number)
        start = _number(fields[2]) if len(fields) > 4 else None
        length = _number(fields[3]) if len(fields) > 4 else None
        if start is None or length is None or start < 0 or length < 0:
            raise InputError.about(f"line {number}", found=line[:60], allowed=CTM)
        label = (start, start + length, fields[4])
        recordings.setdefault(f"{fields[0]} {fields[1]}", []).append(label)
    chosen = [name for name in recordings if stem and name.split()[0] == stem] or [*recordings]
    if len(chosen) != 1:
        named = ", ".join(chosen[:5]) or "none"
        raise InputError.about(
            "recordings", found=named, allowed="one, or one called as the sound file"
        )
    return recordings[chosen[0]]


def _number(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _count(number: int) -> None:
    if number > LABELS_MAX:
        raise InputError(f"more than {LABELS_MAX} rows; allowed: fewer")
