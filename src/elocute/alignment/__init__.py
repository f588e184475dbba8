"""Sequences warped onto each other in time: DTW, soft-DTW, CTW, DCTW, DCAW and one of our own.

    align(views, method) -> Alignment           two or more sequences at once
    fit_aligner(pairs, method) -> Aligner       fitted over many pairs, then `align` for each
    segment_words(sound, text)                  when each word of a text is said

torch is imported by the three deep methods alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.alignment.aligner import Aligner
    from elocute.alignment.alignment import Alignment
    from elocute.alignment.forced_alignment import SpokenWord, segment_words
    from elocute.alignment.methods import METHODS, align, fit_aligner
    from elocute.alignment.settings import (
        AlignConfig,
        CcaSoftConfig,
        CtwConfig,
        DcawConfig,
        DctwConfig,
        DtwConfig,
        SoftDtwConfig,
    )
    from elocute.alignment.sound_views import speech_view
    from elocute.alignment.word_times import TimedWord, TimedWords, read_words, write_words

__all__ = [
    "METHODS",
    "AlignConfig",
    "Aligner",
    "Alignment",
    "CcaSoftConfig",
    "CtwConfig",
    "DcawConfig",
    "DctwConfig",
    "DtwConfig",
    "SoftDtwConfig",
    "SpokenWord",
    "TimedWord",
    "TimedWords",
    "align",
    "fit_aligner",
    "read_words",
    "segment_words",
    "speech_view",
    "write_words",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "aligner": ("Aligner",),
        "alignment": ("Alignment",),
        "forced_alignment": ("SpokenWord", "segment_words"),
        "methods": ("METHODS", "align", "fit_aligner"),
        "settings": (
            "AlignConfig",
            "CcaSoftConfig",
            "CtwConfig",
            "DcawConfig",
            "DctwConfig",
            "DtwConfig",
            "SoftDtwConfig",
        ),
        "sound_views": ("speech_view",),
        "word_times": ("TimedWord", "TimedWords", "read_words", "write_words"),
    },
)
