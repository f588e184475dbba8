"""Known phone times from a file."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path

from elocute.audio.phones_and_visemes import PHONES
from elocute.errors import InputError
from elocute.files.reading import read_text

BYTES_MAX = 50_000_000
COLUMNS = ["start_s", "end_s", "phone"]


def read_phone_times(path: str | Path) -> list[tuple[float, float, str]]:
    """Read phones and their times from a CSV with the columns start_s, end_s and phone.

    Parameters
    ----------
    path : str or Path
        The file. Stress digits are dropped.

    Returns
    -------
    list of (float, float, str)
        Start in s, end in s, ARPAbet phone.

    Raises
    ------
    InputError
        Naming the row.
    """
    path = Path(path)
    text = read_text(path, max_bytes=BYTES_MAX, allowed=f"a CSV of {','.join(COLUMNS)}")
    rows = _rows(path, text)
    number, first = next(rows, (1, []))
    if number != 1 or [name.strip() for name in first] != COLUMNS:
        raise InputError.about(
            path,
            found=f"first row {','.join(first[:20]) or 'missing'}"[:80],
            allowed=",".join(COLUMNS),
        )
    return [_row(path, number, row) for number, row in rows]


def _rows(path: Path, text: str) -> Iterator[tuple[int, list[str]]]:
    """Number and fields of each row that is not empty; never all of them at once."""
    try:
        for number, row in enumerate(csv.reader(io.StringIO(text, newline="")), 1):
            if row:
                yield number, row
    except csv.Error as error:
        raise InputError.about(path, found="not a CSV", allowed=",".join(COLUMNS)) from error


def _row(path: Path, number: int, row: list[str]) -> tuple[float, float, str]:
    try:
        start_s, end_s, phone = float(row[0]), float(row[1]), row[2].strip().upper().rstrip("012")
    except (ValueError, IndexError):
        start_s, end_s, phone = 0.0, -1.0, ""
    if not (0 <= start_s <= end_s < 1e6) or phone not in PHONES:
        raise InputError.about(
            f"{path} row {number}",
            found=",".join(field[:60] for field in row[:4])[:60],
            allowed=f"0 <= start <= end, and one of {' '.join(PHONES)}",
        )
    return start_s, end_s, phone
