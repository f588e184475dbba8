"""The rules of `elocute.articulation` as a speech model, in styles that can be mixed."""

from __future__ import annotations

from elocute.articulation.driver import LOOKAHEAD_S, articulate
from elocute.articulation.style import Style
from elocute.audio.features import Features
from elocute.models.feature_extraction import PhonePosteriorStream
from elocute.models.protocol import FeatureStreams, FrameSpan, SoundLevel, SpeechFeatures
from elocute.models.rule_styles import StyledAsRules
from elocute.motion.curves import Curves


class ArticulationModel(StyledAsRules):
    """The rules as a SpeechModel; its styles are those of `elocute.articulation.style`."""

    name, fps = "articulation", 60.0
    decoder_lookahead_s = LOOKAHEAD_S

    def feature_streams(
        self,
        sample_rate: int,
        *,
        contacts: bool = True,
        level: SoundLevel | None = None,
        live: bool = False,
    ) -> FeatureStreams:
        return FeatureStreams(PhonePosteriorStream(sample_rate))

    def curves(
        self,
        speech: SpeechFeatures,
        style: Style,
        span: FrameSpan,
        strength: float = 1.0,
        *,
        contacts: bool = True,
    ) -> Curves:
        """Curves 0…1 of every shape that speech uses.

        Without contacts: coarticulated shapes in their style; nothing closes the lips on p, b and
        m, holds the lower lip at the teeth on f and v, or shuts the mouth in a pause.
        """
        return _articulated(speech.features, style, span, strength, contacts)


def _articulated(
    phones: Features, style: Style, span: FrameSpan, strength: float, contacts: bool
) -> Curves:
    return articulate(
        phones.values,
        phones.rate,
        frame_count=span.count,
        fps=span.fps,
        style=style,
        strength=strength,
        first_frame=span.first,
        first_row=phones.first,
        contacts=contacts,
    )
