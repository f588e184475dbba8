"""What every self-contained page is made of: its text with things put in, safe inside scripts."""

from __future__ import annotations

import base64
import gzip
import json
from typing import Any


def filled_page(page: str, parts: dict[str, str]) -> list[str]:
    """A page with its marks, such as "@TITLE@", replaced, as pieces to be joined or written.

    What stands for a mark is never searched for marks itself.
    """
    pieces, rest = [], page
    while rest:
        marks = [(rest.index(mark), mark) for mark in parts if mark in rest]
        if not marks:
            return [*pieces, rest]
        place, mark = min(marks)
        pieces += [rest[:place], parts[mark]]
        rest = rest[place + len(mark) :]
    return pieces


def script_json(value: Any) -> str:
    """JSON without "<", so that nothing in it can end its script element."""
    return json.dumps(value).replace("<", "\\u003c")


def script_bytes(data: bytes) -> str:
    """Bytes compressed by gzip, in base64; the same for the same bytes, since no time is stored."""
    return base64.b64encode(gzip.compress(data, 6, mtime=0)).decode()
