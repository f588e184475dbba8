"""Looks of the built-in head: skin, eyes, hair, brows, lashes, clothes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.head.looks.dressing import dress as dress, dressed as dressed
    from elocute.head.looks.look import Look as Look
    from elocute.head.looks.people import (
        PEOPLE as PEOPLE,
        face_look as face_look,
        identity_look as identity_look,
        person as person,
        random_look as random_look,
        resolve_look as resolve_look,
    )

__getattr__, __dir__ = lazy(__name__, __file__)
