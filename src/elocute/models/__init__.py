"""Models that turn speech into motion, by name or file; live streams; styles found in motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.models.browser_tables import write_browser_tables as write_browser_tables
    from elocute.models.feature_extraction import extract_features as extract_features
    from elocute.models.protocol import (
        FrameSpan as FrameSpan,
        SpeechFeatures as SpeechFeatures,
        SpeechModel as SpeechModel,
    )
    from elocute.models.registry import model_names as model_names, open_model as open_model
    from elocute.models.streaming import Frame as Frame, Stream as Stream, stream as stream
    from elocute.models.style_fit import StyleFit as StyleFit, fit_style as fit_style
    from elocute.models.style_mixes import read_mix as read_mix, write_mix as write_mix
    from elocute.models.style_targets import ObservedMotion as ObservedMotion

__getattr__, __dir__ = lazy(__name__, __file__)
