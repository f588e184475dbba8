"""The rules of `elocute.articulation` as a speech model, and the base of models in its styles."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping

from elocute.array_types import Float32Array
from elocute.articulation.driver import LOOKAHEAD_S, articulate
from elocute.articulation.style import STYLES, Style, mix_styles, resolve_style
from elocute.audio.resampling_stream import RESAMPLING_S
from elocute.audio.waveform import Waveform
from elocute.encoders.trunk import trunk_lookahead_s
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.models.feature_extraction import PhonePosteriorStream
from elocute.models.protocol import FeatureStreams, FrameSpan, SoundLevel, SpeechFeatures
from elocute.models.style_mixes import EVEN
from elocute.motion.curves import Curves


class StyledAsRules:
    """The part of a SpeechModel that its head and its styles decide.

    Styles are numbers, so a mix of them is one of these numbers whether it is asked for at the
    input or of the outputs.
    """

    encoder = "phones"
    basis: Float32Array | None = None
    needs_sound_level, makes_contacts = False, True
    styles = tuple(STYLES)
    decoder_lookahead_s: float

    @abstractmethod
    def curves(
        self,
        speech: SpeechFeatures,
        style: Style,
        span: FrameSpan,
        strength: float = 1.0,
        *,
        contacts: bool = True,
    ) -> Curves:
        """Curves 0…1 of every shape that speech uses."""

    @property
    def components(self) -> tuple[str, ...]:
        return load_builtin_head().expression_names

    @property
    def topology(self) -> str:
        return load_builtin_head().name

    @property
    def vertex_count(self) -> int:
        return load_builtin_head().vertex_count

    @property
    def live_lookahead_s(self) -> float:
        return math.inf

    @property
    def lookahead_s(self) -> float:
        return RESAMPLING_S + trunk_lookahead_s() + self.decoder_lookahead_s

    def style(self, given: str | Style, *, outputs: bool = True) -> Style:
        """A Style, a name, a mix of numbers, `even`, or a .json file. Raises InputError."""
        if isinstance(given, str) and given == EVEN:
            return mix_styles(dict.fromkeys(STYLES, 1 / len(STYLES)))
        return resolve_style(given)

    def mix(self, shares: Mapping[str, float], *, outputs: bool = True) -> Style:
        """The convex mix of named styles, number by number. Raises InputError."""
        return mix_styles(dict(shares))

    def sound_level(self, sound: Waveform) -> None:
        """None: what it hears is normalised as it comes in."""

    def weights(self, speech: SpeechFeatures, style: Style, span: FrameSpan) -> Float32Array:
        """(frame, component) of every shape of the built-in head, with contacts."""
        return self.curves(speech, style, span).select(self.components).values

    def rig(self, head: HeadModel) -> HeadModel:
        return head


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
        within_s: float | None = None,
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
        phones = speech.features
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
