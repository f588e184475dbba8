"""Phones to curves by rules: viseme shapes, coarticulation, contacts, style."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.articulation.driver import articulate
    from elocute.articulation.style import STYLES, Style, mix_styles, parse_mix, resolve_style

__all__ = [
    "STYLES",
    "Style",
    "articulate",
    "mix_styles",
    "parse_mix",
    "resolve_style",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "driver": ("articulate",),
        "style": ("STYLES", "Style", "mix_styles", "parse_mix", "resolve_style"),
    },
)
