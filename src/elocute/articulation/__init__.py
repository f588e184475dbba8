"""Phones to curves by rules: viseme shapes, coarticulation, contacts, style."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.articulation.driver import articulate as articulate
    from elocute.articulation.style import (
        STYLES as STYLES,
        Style as Style,
        mix_styles as mix_styles,
        parse_mix as parse_mix,
        resolve_style as resolve_style,
    )

__getattr__, __dir__ = lazy(__name__, __file__)
