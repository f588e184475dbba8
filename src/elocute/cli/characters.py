"""What commands tell of a character in a file of its own."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from elocute.errors import printable

if TYPE_CHECKING:
    from elocute.adoption.characters.open_character import OpenedCharacter


def print_character(file: Path, mesh: str | None, as_json: bool) -> None:
    """Describe a character. Raises HeadError."""
    from elocute.adoption.characters.open_character import open_character

    tell_character(file, open_character(file, mesh), as_json)


def tell_character(file: Path, opened: OpenedCharacter, as_json: bool, **more: Any) -> None:
    """Print how a character was understood; more: what the record holds beside it."""
    from elocute.adoption.characters.report import character_record, report_lines

    record = character_record(opened)
    if as_json:
        print(json.dumps({"file": str(file), "kind": "character", **more, **record}))
        return
    print(f"{'file':12} {printable(file)}\n{'kind':12} character")
    for line in report_lines(record):
        print(printable(line))
