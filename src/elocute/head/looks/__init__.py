"""Looks of the built-in head: skin, eyes, hair, brows, lashes, clothes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.head.looks.dressing import dress, dressed
    from elocute.head.looks.look import Look
    from elocute.head.looks.people import (
        PEOPLE,
        face_look,
        identity_look,
        person,
        random_look,
        resolve_look,
    )

__all__ = [
    "PEOPLE",
    "Look",
    "dress",
    "dressed",
    "face_look",
    "identity_look",
    "person",
    "random_look",
    "resolve_look",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "dressing": ("dress", "dressed"),
        "look": ("Look",),
        "people": (
            "PEOPLE",
            "face_look",
            "identity_look",
            "person",
            "random_look",
            "resolve_look",
        ),
    },
)
