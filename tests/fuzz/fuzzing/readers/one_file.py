"""Readers of one file, and of one text, as a case calls them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path


def only(read: Callable[[Path], object]) -> Callable[[Path, Path], object]:
    """For readers of one file: the only one in the folder."""
    return lambda folder, _out: read(next(path for path in folder.iterdir()))


def text(read: Callable[[str], object]) -> Callable[[Path, Path], object]:
    """For texts of options, as a shell hands them over."""
    return only(
        lambda path: read(path.read_bytes().replace(b"\0", b"").decode("utf-8", "surrogateescape"))
    )
