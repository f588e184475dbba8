"""Lists of names in text files."""

from __future__ import annotations

from pathlib import Path

from elocute.errors import InputError
from elocute.files.reading import FileKind

NAMES_FILE = FileKind("a text file with one name per line", 16_000_000)


def read_names(path: Path | None, *, least: int = 1) -> list[str] | None:
    """The names in a file, None for no file. Raises InputError for fewer than `least`."""
    if path is None:
        return None
    from elocute.files.reading import read_text

    names = read_text(path, NAMES_FILE).split()
    if len(names) < least:
        raise InputError.about(path, found="no names", allowed="one name per line")
    return names
