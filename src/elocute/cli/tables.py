"""Tables of evaluations as files: CSV for machines, LaTeX for papers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from elocute.errors import InputError
from elocute.files.atomic import write_atomically
from elocute.files.output_plan import OutputPlan

if TYPE_CHECKING:
    from elocute.evaluation.table_text import Cell

SUFFIXES = (".csv", ".tex")


def check_tables(paths: Sequence[Path] | None) -> list[Path]:
    """The paths, none for None. Raises InputError for a suffix other than SUFFIXES."""
    for path in paths or ():
        if path.suffix.lower() not in SUFFIXES:
            raise InputError.about(
                path, found=f"suffix {path.suffix!r}", allowed=" or ".join(SUFFIXES)
            )
    return list(paths or ())


def write_tables(
    plan: OutputPlan,
    paths: Sequence[Path],
    columns: Sequence[str],
    rows: Sequence[Sequence[Cell]],
) -> None:
    """Write one table to every path that is planned, in the format of its suffix.

    An interval takes three columns of a CSV (value, low, high; all digits), and one of LaTeX
    (three digits). Raises OutputError.
    """
    from elocute.evaluation.table_text import csv_text, latex_text

    for path in paths:
        if not plan.wants(path):
            continue
        text = (csv_text if path.suffix.lower() == ".csv" else latex_text)(columns, rows)
        with plan.writing(path), write_atomically(path) as draft:
            draft.write_text(text, encoding="utf-8", newline="")
