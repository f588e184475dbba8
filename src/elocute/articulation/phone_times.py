"""Known phone times from a file."""

from __future__ import annotations

import csv
from pathlib import Path

from elocute.audio.phones import PHONES
from elocute.errors import InputError

BYTES_MAX = 50_000_000
COLUMNS = ["start_s", "end_s", "phone"]


def read_phone_times(path: str | Path) -> list[tuple[float, float, str]]:
    """(start s, end s, ARPAbet phone) of each row of a CSV `start_s,end_s,phone`.

    Stress digits are dropped. Raises InputError naming the row.
    """
    path = Path(path)
    try:
        if path.stat().st_size > BYTES_MAX:
            raise InputError.about(path, found="more than 50 MB", allowed="a CSV of phone times")
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
    except OSError as error:
        raise InputError.about(path, found=f"cannot be read ({error.strerror})") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError.about(path, found="no text", allowed=",".join(COLUMNS)) from error
    if not rows or [name.strip() for name in rows[0]] != COLUMNS:
        raise InputError.about(
            path, found=f"first row {','.join(rows[0]) if rows else 'missing'}"[:80],
            allowed=",".join(COLUMNS),
        )  # fmt: skip
    return [_row(path, number, row) for number, row in enumerate(rows[1:], 2) if row]


def _row(path: Path, number: int, row: list[str]) -> tuple[float, float, str]:
    try:
        start_s, end_s, phone = float(row[0]), float(row[1]), row[2].strip().upper().rstrip("012")
    except (ValueError, IndexError):
        start_s, end_s, phone = 0.0, -1.0, ""
    if not (0 <= start_s <= end_s < 1e6) or phone not in PHONES:
        raise InputError.about(
            f"{path} row {number}", found=",".join(row)[:60],
            allowed=f"0 <= start <= end, and one of {' '.join(PHONES)}",
        )  # fmt: skip
    return start_s, end_s, phone
