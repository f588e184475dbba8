"""Tables of evaluations as files: CSV for machines, LaTeX for papers."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from elocute.errors import InputError
from elocute.evaluation.confidence_intervals import ConfidenceInterval
from elocute.files.atomic import write_atomically
from elocute.files.output_plan import OutputPlan

Cell = str | int | float | ConfidenceInterval | None
"""None, NaN and an interval without a value stand for what is not available."""
SUFFIXES = (".csv", ".tex")
LATEX = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "²": "$^2$",
    "³": "$^3$",
    "ρ": r"$\rho$",
}


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
    for path in paths:
        if not plan.wants(path):
            continue
        text = (_csv if path.suffix.lower() == ".csv" else _latex)(columns, rows)
        with plan.writing(path), write_atomically(path) as draft:
            draft.write_text(text, encoding="utf-8", newline="")


def _csv(columns: Sequence[str], rows: Sequence[Sequence[Cell]]) -> str:
    wide = _with_intervals(columns, rows)
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(
        name
        for column, three in zip(columns, wide, strict=True)
        for name in ((column, f"{column} low", f"{column} high") if three else (column,))
    )
    for row in rows:
        writer.writerow(v for cell, t in zip(row, wide, strict=True) for v in _values(cell, t))
    return text.getvalue()


def _with_intervals(columns: Sequence[str], rows: Sequence[Sequence[Cell]]) -> list[bool]:
    """Of each column, whether it holds intervals."""
    return [
        any(isinstance(row[k], ConfidenceInterval) for row in rows) for k in range(len(columns))
    ]


def _values(cell: Cell, three: bool) -> tuple[object, ...]:
    if not three:
        return ("" if cell is None or cell != cell else cell,)
    if not isinstance(cell, ConfidenceInterval) or cell.record() is None:
        return ("", "", "")
    return (cell.value, cell.low, cell.high)


def _latex(columns: Sequence[str], rows: Sequence[Sequence[Cell]]) -> str:
    """A tabular for the package booktabs; columns of words to the left, of numbers right."""
    words = [all(isinstance(row[k], str) for row in rows) for k in range(len(columns))]
    body = [" & ".join(_escaped(name) for name in columns) + r" \\", r"\midrule"]
    body += [" & ".join(map(_latex_cell, row)) + r" \\" for row in rows]
    places = "".join("l" if left else "r" for left in words)
    lines = [rf"\begin{{tabular}}{{{places}}}", r"\toprule", *body, r"\bottomrule"]
    return "\n".join([*lines, r"\end{tabular}", ""])


def _latex_cell(cell: Cell) -> str:
    lacking = cell.record() is None if isinstance(cell, ConfidenceInterval) else cell != cell
    if cell is None or lacking:
        return "--"
    if isinstance(cell, ConfidenceInterval):
        return f"${cell.value:.3g}$ [${cell.low:.3g}$, ${cell.high:.3g}$]"
    if isinstance(cell, float):
        return f"${cell:.3g}$"
    return _escaped(str(cell))


def _escaped(text: str) -> str:
    return "".join(LATEX.get(letter, letter) for letter in text)
