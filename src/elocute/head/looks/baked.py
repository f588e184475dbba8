"""Loads the baked pictures and cards that looks are made from (see docs/cards/looks.md)."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from elocute.errors import HeadError
from elocute.files.array_reading import read_npz
from elocute.files.reading import FileKind

FOLDER = Path(__file__).parent / "assets"
CARDS_FILE = FileKind("cards of a look", 10_000_000, HeadError)


@lru_cache(maxsize=64)
def picture(place: str) -> bytes:
    """An encoded picture, by its place without suffix ("hair/short01")."""
    for suffix in (".webp", ".jpg", ".png"):
        path = FOLDER / (place + suffix)
        if path.is_file():
            return path.read_bytes()
    raise FileNotFoundError(FOLDER / place)


@lru_cache(maxsize=64)
def arrays(place: str) -> dict[str, NDArray[Any]]:
    """The arrays of a part that is worn."""
    path = FOLDER / f"{place}.npz"
    return read_npz(path, CARDS_FILE)
