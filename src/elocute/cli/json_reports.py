"""Reports of evaluations: one JSON record, to a file and to machines."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def write_json_report(path: Path, report: Mapping[str, Any]) -> str:
    """Write the record whole or not at all, and give its text. Raises OutputError."""
    from elocute.files.atomic import write_atomically

    text = json.dumps(report, allow_nan=False)
    with write_atomically(path) as draft:
        draft.write_text(text + "\n", encoding="utf-8")
    return text
