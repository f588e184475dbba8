"""Tables of evaluations as text: CSV for machines, LaTeX for papers."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from elocute.evaluation.confidence_intervals import ConfidenceInterval

Cell = str | int | float | ConfidenceInterval | None
"""None, NaN and an interval without a value stand for what is not available."""
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
    "<": "$<$",
    ">": "$>$",
    "–": "--",
    "²": "$^2$",
    "³": "$^3$",
    "ρ": r"$\rho$",
}


def csv_text(columns: Sequence[str], rows: Sequence[Sequence[Cell]]) -> str:
    """A table as CSV with all digits; an interval takes three columns: value, low, high."""
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


def latex_text(
    columns: Sequence[str],
    rows: Sequence[Sequence[Cell]],
    words: Sequence[bool] | None = None,
) -> str:
    """A table as a tabular for the package booktabs, with three digits; intervals take one column.

    words: which columns stand to the left; by default those of texts.
    """
    words = words or [all(isinstance(row[k], str) for row in rows) for k in range(len(columns))]
    body = [" & ".join(latex_escaped(name) for name in columns) + r" \\", r"\midrule"]
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
    return latex_escaped(str(cell))


def latex_escaped(text: str) -> str:
    """A text as LaTeX shows it: none of its characters is a command."""
    return "".join(LATEX.get(letter, letter) for letter in text)
