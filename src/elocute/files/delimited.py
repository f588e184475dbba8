"""Tables in text with a first row of names, parted by commas, semicolons or tabs."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass

DELIMITERS = ",;\t"


@dataclass(frozen=True)
class DelimitedTable:
    """A table, not read yet."""

    names: tuple[str, ...]  # its first row, in small letters, with _ for spaces
    delimiter: str  # what parts its cells
    body: str  # the rows below the names
    skipped: int  # rows before the first of the body

    @classmethod
    def of(cls, text: str) -> DelimitedTable:
        """The table of a text. Raises csv.Error."""
        stream = io.StringIO(text, newline="")
        first, skipped = stream.readline(), 1
        delimiter = max(DELIMITERS, key=first.count)
        if first.lower().startswith("sep=") and len(first.strip()) == 5:  # Excel says so itself
            delimiter, skipped = first.strip()[-1], 2
        else:
            stream.seek(0)
        rows = csv.reader(stream, delimiter=delimiter)
        names = tuple(name.strip().lower().replace(" ", "_") for name in next(rows, []))
        return cls(names, delimiter, stream.read(), skipped)

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """The number of each row that is not empty, counted from 1, and its cells. Raises
        csv.Error."""
        reader = csv.reader(io.StringIO(self.body, newline=""), delimiter=self.delimiter)
        for number, row in enumerate(reader, self.skipped + 1):
            if any(cell.strip() for cell in row):
                yield number, [cell.strip() for cell in row]

    def number_text(self, cell: str) -> str:
        """A number with a point: where commas do not part cells, one may part decimals."""
        return cell if self.delimiter == "," else cell.replace(",", ".")
