"""Times of phones and words in tables: CSV and CTM."""

from __future__ import annotations

import csv
import io
import math

from elocute.audio.timed_labels import LABELS_MAX, Label, Labels
from elocute.errors import InputError

PHONES = ("start_s", "end_s", "phone")
WORDS = ("start_s", "end_s", "word")
MFA = ("begin", "end", "label", "type")
COLUMNS = f"{','.join(PHONES)}, {','.join(WORDS)}, or MFA's Begin,End,Label,Type,Speaker"
CTM = "lines of recording, channel, start, duration and label"


def parse_csv(text: str) -> Labels:
    """Phones or words of a table with a first row of names. Raises InputError naming the row."""
    found = Labels()
    speakers: set[str] = set()
    try:
        rows = csv.reader(io.StringIO(text, newline=""))
        names = [name.strip().lower() for name in next(rows, [])]
        kind = _kind(names)
        for number, row in enumerate(rows, 2):
            if not row:
                continue
            _count(number)
            if len(row) < len(kind):
                raise _fault(number, row)
            start, end = _number(row[0]), _number(row[1])
            if start is None or end is None or not 0 <= start <= end:
                raise _fault(number, row)
            label = (start, end, row[2].strip())
            if kind == MFA:
                speakers.add(row[4].strip() if len(row) > 4 else "")
                is_phone = row[3].strip().lower().startswith("phone")
            else:
                is_phone = kind == PHONES
            (found.phones if is_phone else found.words).append(label)
    except csv.Error as error:
        raise InputError(f"not a CSV ({str(error)[:60]}); allowed: {COLUMNS}") from error
    if len(speakers) > 1:
        named = ", ".join(sorted(speakers)[:5])
        raise InputError.about("speakers", found=named, allowed="one in a file")
    return found


def _kind(names: list[str]) -> tuple[str, ...]:
    """Which table it is. Raises InputError."""
    for kind in (PHONES, WORDS, MFA):
        if tuple(names[: len(kind)]) == kind and (kind == MFA or len(names) == 3):
            return kind
    raise InputError(f"first row {','.join(names[:20])[:80] or 'missing'}; allowed: {COLUMNS}")


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


def _fault(number: int, row: list[str]) -> InputError:
    shown = ",".join(cell[:60] for cell in row[:4])[:60]
    return InputError.about(f"row {number}", found=shown, allowed=f"0 <= start <= end; {COLUMNS}")
