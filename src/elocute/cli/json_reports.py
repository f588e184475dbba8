"""Reports of evaluations as files of JSON."""

from __future__ import annotations

from pathlib import Path


def write_json_report(path: Path, text: str) -> None:
    """Write the text of a JSON record, whole or not at all. Raises OutputError."""
    from elocute.files.atomic import write_atomically

    with write_atomically(path) as draft:
        draft.write_text(text + "\n", encoding="utf-8")
