"""A report as a PDF of A4 pages: the same texts, plots and tables, one below the other."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Sequence
from typing import Any

from elocute.study.report.plots import FAINT, INK
from elocute.study.report.report_page import WIDTH_IN, drawing
from elocute.study.report.report_parts import Plot, Report, Table, is_text, shown

PAGE_IN = (8.27, 11.69)
MARGIN_IN = 0.65
LINE_IN = 0.19
LETTER_IN = 0.064
"""Width of a letter of a table at `TABLE_PT`, on average and generously."""
TABLE_PT, TEXT_PT = 8.0, 9.5
TEXT_WIDTH = 100
"""Letters in a line of text."""
CELL_MAX = 34
"""Letters of a cell in a line; the rest goes below."""


def pdf_bytes(report: Report) -> bytes:
    """A report as a PDF, the same for the same report.

    Raises MachineError where matplotlib is missing.
    """
    file = io.BytesIO()
    with drawing("pdf") as figures:
        from matplotlib.backends.backend_pdf import PdfPages

        about = {"Title": report.title, "Creator": "Elocute", "Producer": None}
        about |= {"CreationDate": None, "ModDate": None}
        with PdfPages(file, metadata=about) as pages:
            sheet = _Sheet(figures, pages)
            _write(sheet, report)
            sheet.close()
    return file.getvalue()


def _write(sheet: _Sheet, report: Report) -> None:
    sheet.text(report.title, size=17, bold=True, width=56)
    sheet.text("Report of a perceptual study", colour=FAINT)
    for warning in report.warnings:
        sheet.text(warning, bold=True)
    sheet.gap()
    for name, value in report.facts:
        sheet.text(f"{name}: {value}")
    for section in report.sections:
        sheet.gap(0.25)
        sheet.text(section.title, size=13, bold=True, keep_in=1.5)
        for text in section.texts:
            sheet.text(text)
        for plot in section.plots:
            sheet.plot(plot)
        for table in section.tables:
            sheet.table(table)


class _Sheet:
    """Pages that are filled from the top."""

    def __init__(self, figures: Any, pages: Any) -> None:
        self._figures, self._pages = figures, pages
        self._figure: Any = None
        self._left = 0.0  # to the bottom, in inches
        self._number = 0

    def close(self) -> None:
        if self._figure is not None:
            self._pages.savefig(self._figure)
            self._figure = None

    def room(self, inches: float) -> None:
        """Turn the page where there is less room than this."""
        if self._figure is None or self._left < inches:
            self.close()
            self._figure = self._figures.Figure(figsize=PAGE_IN)
            self._left = PAGE_IN[1] - 2 * MARGIN_IN
            self._number += 1
            self._put(PAGE_IN[0] - MARGIN_IN, 0.4, str(self._number), 8, FAINT, ha="right")

    def gap(self, inches: float = 0.12) -> None:
        self._left -= inches

    def _put(self, x: float, y: float, text: str, size: float, colour: str, **more: Any) -> None:
        self._figure.text(
            x / PAGE_IN[0], y / PAGE_IN[1], text, fontsize=size, color=colour, va="top", **more
        )

    def text(
        self,
        text: str,
        *,
        size: float = TEXT_PT,
        bold: bool = False,
        colour: str = INK,
        width: int = TEXT_WIDTH,
        keep_in: float = 0.0,
    ) -> None:
        """Write lines; `keep_in` is the room that must be left for what follows."""
        step = LINE_IN * size / TEXT_PT
        lines = textwrap.wrap(text, width) or [""]
        self.room(min(len(lines), 3) * step + keep_in)
        for line in lines:
            self.room(step)
            self._put(
                MARGIN_IN,
                self._left + MARGIN_IN,
                line,
                size,
                colour,
                weight="bold" if bold else "normal",
            )
            self._left -= step
        self._left -= 0.06

    def plot(self, plot: Plot) -> None:
        """Draw a plot under its title."""
        self.room(plot.height + 2 * LINE_IN)
        self.text(plot.title, bold=True)
        within = (PAGE_IN[0] - WIDTH_IN) / 2 / PAGE_IN[0]
        # Room for names of rows at the left and of the axis below.
        left, low = within + 0.22 * WIDTH_IN / PAGE_IN[0], 0.5
        axes = self._figure.add_axes(
            (
                left,
                (self._left - plot.height + low + MARGIN_IN) / PAGE_IN[1],
                0.68 * WIDTH_IN / PAGE_IN[0],
                (plot.height - low - 0.1) / PAGE_IN[1],
            )
        )
        plot.draw(axes)
        self._left -= plot.height + 0.1

    def table(self, table: Table) -> None:
        """Write a table, its columns as wide as they need, its heading again on every page."""
        rows = [
            [shown(cell, name) for cell, name in zip(row, table.columns, strict=True)]
            for row in table.rows
        ]
        wrapped = [[textwrap.wrap(cell, CELL_MAX) or [""] for cell in row] for row in rows]
        widths = [
            max([_longest_word(name), *(len(line) for row in wrapped for line in row[place])])
            for place, name in enumerate(table.columns)
        ]
        head = [
            textwrap.wrap(name, max(width, 8)) or [""]
            for name, width in zip(table.columns, widths, strict=True)
        ]
        widths = [max(width, *map(len, lines)) for width, lines in zip(widths, head, strict=True)]
        wide = sum(widths) + 2 * len(widths)
        size = TABLE_PT * min(1.0, (PAGE_IN[0] - 2 * MARGIN_IN) / (wide * LETTER_IN))
        lefts = [is_text(table, place) for place in range(len(table.columns))]
        self.room((max(map(len, head)) + 4) * LINE_IN)
        self.text(table.title, bold=True)
        self._lines(head, widths, lefts, size, bold=True)
        for row in wrapped:
            if self._left < max(map(len, row)) * LINE_IN:
                self.room(PAGE_IN[1])
                self._lines(head, widths, lefts, size, bold=True)
            self._lines(row, widths, lefts, size)
        if table.note:
            self.text(table.note, size=8, colour=FAINT, width=118)
        self.gap()

    def _lines(
        self,
        cells: Sequence[Sequence[str]],
        widths: Sequence[int],
        lefts: Sequence[bool],
        size: float,
        bold: bool = False,
    ) -> None:
        letter = LETTER_IN * size / TABLE_PT
        x = MARGIN_IN
        for lines, width, left in zip(cells, widths, lefts, strict=True):
            for place, line in enumerate(lines):
                self._put(
                    x if left else x + width * letter,
                    self._left + MARGIN_IN - place * LINE_IN * 0.9,
                    line,
                    size,
                    INK,
                    ha="left" if left else "right",
                    weight="bold" if bold else "normal",
                )
            x += (width + 2) * letter
        self._left -= max(map(len, cells)) * LINE_IN * 0.9 + 0.02


def _longest_word(text: str) -> int:
    return max(map(len, text.split()), default=1)
