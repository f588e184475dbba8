"""Names of clips: those of a text file, and those of a part of a corpus."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING

from elocute.errors import CorpusError, InputError
from elocute.files.reading import FileKind

if TYPE_CHECKING:
    from elocute.corpus.corpus_store import Corpus

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


def names_of_part(corpus: Corpus, split: str, part: str, parts: Collection[str]) -> list[str]:
    """The clips of a part of a split, or of "all"; `parts` are those that a command knows.

    Raises InputError for another part, and CorpusError for one without clips.
    """
    if part not in parts:
        raise InputError.about(f"--part {part}", found="unknown", allowed=", ".join(parts))
    if part == "all":
        return [entry.name for entry in corpus.entries]
    names = list(corpus.split(split).parts()[part])
    if not names:
        raise CorpusError.about(corpus.folder, found=f"no clip in {part} of split {split}")
    return names
