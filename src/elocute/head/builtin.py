"""The head that ships with Elocute (see docs/cards/head.md)."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from elocute.head.model import HeadModel
from elocute.head.store import load_head

BUILTIN_HEAD_PATH = Path(__file__).parent / "assets" / "head.npz"


@cache
def load_builtin_head() -> HeadModel:
    """The head that ships with Elocute, read once per process.

    Returns
    -------
    HeadModel
        With ARKit's 52 shapes and three for speech, 77 identity components and five joints.
    """
    return load_head(BUILTIN_HEAD_PATH)
