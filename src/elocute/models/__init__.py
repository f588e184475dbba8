"""Models that turn speech into motion, by name or file; live streams; styles found in motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.models.feature_extraction import extract_features
    from elocute.models.protocol import FrameSpan, SpeechFeatures, SpeechModel
    from elocute.models.registry import model_names, open_model
    from elocute.models.streaming import Frame, Stream, stream
    from elocute.models.style_fit import StyleFit, fit_style
    from elocute.models.style_mixes import read_mix, write_mix
    from elocute.models.style_targets import ObservedMotion

__all__ = [
    "Frame",
    "FrameSpan",
    "ObservedMotion",
    "SpeechFeatures",
    "SpeechModel",
    "Stream",
    "StyleFit",
    "extract_features",
    "fit_style",
    "model_names",
    "open_model",
    "read_mix",
    "stream",
    "write_mix",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "feature_extraction": ("extract_features",),
        "protocol": ("FrameSpan", "SpeechFeatures", "SpeechModel"),
        "registry": ("model_names", "open_model"),
        "streaming": ("Frame", "Stream", "stream"),
        "style_fit": ("StyleFit", "fit_style"),
        "style_targets": ("ObservedMotion",),
        "style_mixes": ("read_mix", "write_mix"),
    },
)
