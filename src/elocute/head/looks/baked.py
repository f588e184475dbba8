"""What looks are made from: baked pictures and cards (see docs/cards/looks.md)."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

FOLDER = Path(__file__).parent / "assets"


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
    with np.load(FOLDER / f"{place}.npz", allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}
