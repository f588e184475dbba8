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
    """A table.

    Attributes
    ----------
    name : str
        Of its files.
    title : str
        What it shows.
    columns : tuple of str
        Headings; a heading that ends in "%" has shares below, shown as percent.
    rows : list of list of Cell
        Cells.
    note : str
        What to know when reading it.
    """

    name: str
    title: str
    columns: tuple[str, ...]
    rows: list[list[Cell]]
    note: str = ""


@dataclass(frozen=True)
class Plot:
    """A plot; what it shows stands in a table too.

    Attributes
    ----------
    name : str
        Of its element.
    title : str
        What it shows.
    told : str
        The same in a sentence, for who cannot see it.
    draw : callable
        Draws on an `Axes` of matplotlib.
    height : float
        In inches, at a width of 7.
    """

    name: str
    title: str
    told: str
    draw: Callable[[Any], None]
    height: float = 3.0


@dataclass(frozen=True)
class Section:
    """A part of a report under one heading, in the order texts, plots, tables."""

    title: str
    texts: Sequence[str] = ()
    plots: Sequence[Plot] = ()
    tables: Sequence[Table] = ()


@dataclass(frozen=True)
class Report:
    """A report.

    Attributes
    ----------
    title : str
        Of the study.
    facts : list of tuple of str
        What it is about: names and values.
    sections : list of Section
        In their order.
    warnings : list of str
        What must be known before anything is believed.
    """

    title: str
    facts: list[tuple[str, str]]
    sections: list[Section] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    @property
    def tables(self) -> list[Table]:
        """All tables."""
        return [table for section in self.sections for table in section.tables]


def shown(cell: Cell, heading: str) -> str:
    """A cell as people read it.

    Parameters
    ----------
    cell : Cell
        What stands in it.
    heading : str
        Of its column.

    Returns
    -------
    str
    """
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
    """Whether a column of a table holds texts, which stand to the left.

    Parameters
    ----------
    table : Table
        The table.
    place : int
        Of the column, from 0.

    Returns
    -------
    bool
    """
    return bool(table.rows) and all(isinstance(row[place], str) for row in table.rows)


def harmless(cell: Cell) -> Cell:
    """A cell for a spreadsheet, which would run a text that begins like a formula.

    Parameters
    ----------
    cell : Cell
        What stands in it; its text may be a stranger's.

    Returns
    -------
    Cell
    """
    if not isinstance(cell, str):
        return cell
    text = printable(cell)
    return f"'{text}" if text.startswith(tuple(FORMULA)) else text
