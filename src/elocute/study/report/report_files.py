"""A report as files: one page, one PDF, and every table as CSV and LaTeX."""

from __future__ import annotations

import os
from contextlib import nullcontext
from pathlib import Path

from elocute.errors import OutputError
from elocute.evaluation.table_text import Cell, ConfidenceInterval, csv_text, latex_text
from elocute.files.atomic import check_output, moved_aside, write_folder_atomically
from elocute.study.report.report_page import page_text
from elocute.study.report.report_parts import Report, Table, harmless, is_text, shown
from elocute.study.report.report_pdf import pdf_bytes

PAGE, PDF, TABLES = "report.html", "report.pdf", "tables"


def write_report(report: Report, folder: str | Path, *, overwrite: bool = False) -> list[Path]:
    """Write a report into a folder of its own, whole or not at all.

    Parameters
    ----------
    report : Report
        The report.
    folder : str or Path
        Where.
    overwrite : bool
        Replace a report that is there; a folder of anything else never is.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    OutputError
        For a place that is taken or cannot be written.
    MachineError
        Where matplotlib is missing.
    """
    folder = Path(folder)
    check_place(folder, overwrite)
    texts = {PAGE: page_text(report).encode(), PDF: pdf_bytes(report)}
    for table in report.tables:
        texts[f"{TABLES}/{table.name}.csv"] = table_csv(table).encode()
        texts[f"{TABLES}/{table.name}.tex"] = table_latex(table).encode()
    aside = moved_aside(folder) if folder.is_dir() else nullcontext()
    with aside, write_folder_atomically(folder) as draft:
        (draft / TABLES).mkdir()
        for name, data in texts.items():
            (draft / name).write_bytes(data)
    return [folder / name for name in texts]


def check_place(folder: Path, overwrite: bool) -> None:
    """Raise OutputError for a folder that is there, unless it is a report that may be replaced."""
    check_output(folder)
    if not os.path.lexists(folder):
        return
    is_report = folder.is_dir() and {each.name for each in folder.iterdir()} == {PAGE, PDF, TABLES}
    if not is_report:
        raise OutputError.about(
            folder, found="something else than a report", allowed="a new folder, or a report"
        )
    if not overwrite:
        raise OutputError.about(
            folder,
            found="a report is there already",
            allowed="a new folder",
            remedy="`overwrite` replaces it",
        )


def table_csv(table: Table) -> str:
    """A table as CSV that no spreadsheet runs: all digits, shares in percent."""
    rows = [
        [harmless(_scaled(cell, name)) for cell, name in zip(row, table.columns, strict=True)]
        for row in table.rows
    ]
    return csv_text(table.columns, rows)


def table_latex(table: Table) -> str:
    """A table as LaTeX for booktabs, with the digits of the page."""
    rows = [
        [shown(cell, name) for cell, name in zip(row, table.columns, strict=True)]
        for row in table.rows
    ]
    words = [is_text(table, place) for place in range(len(table.columns))]
    return latex_text(table.columns, rows, words)


def _scaled(cell: Cell, heading: str) -> Cell:
    if not heading.endswith("%"):
        return cell
    if isinstance(cell, ConfidenceInterval):
        return ConfidenceInterval(100 * cell.value, 100 * cell.low, 100 * cell.high)
    return 100 * cell if isinstance(cell, float) else cell
