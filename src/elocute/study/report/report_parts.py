"""What a report is made of, whatever file it becomes: facts, texts, tables and plots."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from elocute.errors import printable
from elocute.evaluation.confidence_intervals import ConfidenceInterval
from elocute.evaluation.table_text import Cell

FORMULA = "=+-@\t\r"


@dataclass(frozen=True)
class Table:
    """A table."""

    name: str  # of its files
    title: str  # what it shows
    # Headings; a heading that ends in "%" has shares below, shown as percent.
    columns: tuple[str, ...]
    rows: list[list[Cell]]
    note: str = ""  # what to know when reading it


@dataclass(frozen=True)
class Plot:
    """A plot; what it shows stands in a table too."""

    name: str  # of its element
    title: str  # what it shows
    told: str  # the same in a sentence, for who cannot see it
    draw: Callable[[Any], None]  # draws on an `Axes` of matplotlib
    height: float = 3.0  # in inches, at a width of 7


@dataclass(frozen=True)
class Section:
    """A part of a report under one heading, in the order texts, plots, tables."""

    title: str
    texts: Sequence[str] = ()
    plots: Sequence[Plot] = ()
    tables: Sequence[Table] = ()


@dataclass(frozen=True)
class Report:
    """A report."""

    title: str  # of the study
    facts: list[tuple[str, str]]  # what it is about: names and values
    sections: list[Section] = field(default_factory=list)  # in their order
    # What must be known before anything is believed.
    warnings: list[str] = field(default_factory=list)

    @property
    def tables(self) -> list[Table]:
        """All tables."""
        return [table for section in self.sections for table in section.tables]


def shown(cell: Cell, heading: str) -> str:
    """A cell as people read it under the heading of its column."""
    if isinstance(cell, ConfidenceInterval):
        if cell.value != cell.value:
            return "–"
        number = _percent if heading.endswith("%") else _short
        bounds = f" [{number(cell.low)}, {number(cell.high)}]" if cell.low == cell.low else ""
        return f"{number(cell.value)}{bounds}"
    if cell is None or cell != cell:
        return "–"
    if isinstance(cell, float):
        if heading.split(" ")[0] == "p":
            return "< 0.001" if cell < 0.001 else f"{cell:.3f}"
        return _percent(cell) if heading.endswith("%") else _short(cell)
    return printable(cell)


def _percent(value: float) -> str:
    return f"{100 * value:.1f}"


def _short(value: float) -> str:
    return f"{value:.2f}"


def is_text(table: Table, place: int) -> bool:
    """Whether a column of a table, from 0, holds texts, which stand to the left."""
    return bool(table.rows) and all(isinstance(row[place], str) for row in table.rows)


def harmless(cell: Cell) -> Cell:
    """A cell for a spreadsheet, which would run a stranger's text that begins like a formula."""
    if not isinstance(cell, str):
        return cell
    text = printable(cell)
    return f"'{text}" if text.startswith(tuple(FORMULA)) else text
