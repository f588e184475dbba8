"""Models that turn speech into motion, by name or file; live streams; styles found in motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy import lazy

if TYPE_CHECKING:
    from elocute.models.hearing import hear
    from elocute.models.protocol import Heard, Span, SpeechModel
    from elocute.models.registry import model_names, open_model
    from elocute.models.streaming import Frame, Stream, stream
    from elocute.models.style_file import read_mix, write_mix
    from elocute.models.style_fit import Observed, StyleFit, fit_style

__all__ = [
    "Frame",
    "Heard",
    "Observed",
    "Span",
    "SpeechModel",
    "Stream",
    "StyleFit",
    "fit_style",
    "hear",
    "model_names",
    "open_model",
    "read_mix",
    "stream",
    "write_mix",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "hearing": ("hear",),
        "protocol": ("Heard", "Span", "SpeechModel"),
        "registry": ("model_names", "open_model"),
        "streaming": ("Frame", "Stream", "stream"),
        "style_file": ("read_mix", "write_mix"),
        "style_fit": ("Observed", "StyleFit", "fit_style"),
    },
)
