"""Sequences warped onto each other in time: DTW, soft-DTW, CTW, DCTW and DCAW.

    align(views, method) -> Alignment           two or more sequences at once
    fit_aligner(pairs, method) -> Aligner       fitted over many pairs, then `align` for each

Names are loaded when first used; torch only by the two deep methods.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from elocute.alignment.aligner import Aligner
    from elocute.alignment.alignment import Alignment
    from elocute.alignment.methods import METHODS, align, fit_aligner
    from elocute.alignment.sound_views import speech_view

_HOMES = {
    "METHODS": "methods",
    "Aligner": "aligner",
    "Alignment": "alignment",
    "align": "methods",
    "fit_aligner": "methods",
    "speech_view": "sound_views",
}

__all__ = ["METHODS", "Aligner", "Alignment", "align", "fit_aligner", "speech_view"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'elocute.alignment' has no attribute {name!r}")
    return getattr(importlib.import_module(f"elocute.alignment.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
