"""Sequences warped onto each other in time: DTW, soft-DTW, CTW, DCTW, DCAW and one of our own.

    align(views, method) -> Alignment           two or more sequences at once
    fit_aligner(pairs, method) -> Aligner       fitted over many pairs, then `align` for each

torch is imported by the three deep methods alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.alignment.aligner import Aligner as Aligner
    from elocute.alignment.alignment import Alignment as Alignment
    from elocute.alignment.methods import (
        METHODS as METHODS,
        align as align,
        fit_aligner as fit_aligner,
    )
    from elocute.alignment.settings import (
        AlignConfig as AlignConfig,
        CcaSoftConfig as CcaSoftConfig,
        CtwConfig as CtwConfig,
        DcawConfig as DcawConfig,
        DctwConfig as DctwConfig,
        DtwConfig as DtwConfig,
        SoftDtwConfig as SoftDtwConfig,
    )
    from elocute.alignment.sound_views import speech_view as speech_view

__getattr__, __dir__ = lazy(__name__, __file__)
