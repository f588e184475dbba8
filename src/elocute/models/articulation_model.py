"""The rules of `elocute.articulation` as a speech model, in styles that can be mixed."""

from __future__ import annotations

from collections.abc import Mapping

from elocute.array_types import Float32Array
from elocute.articulation.driver import LOOKAHEAD_S, articulate
from elocute.articulation.style import STYLES, Style, mix_styles, resolve_style
from elocute.audio.features import Features
from elocute.audio.waveform import Waveform
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.models.feature_extraction import RESAMPLING_S, PhonePosteriorStream, phone_lookahead_s
from elocute.models.protocol import FeatureStreams, FrameSpan, SoundLevel, SpeechFeatures
from elocute.models.style_mixes import EVEN
from elocute.motion.curves import Curves

NAME = "articulation"


class ArticulationModel:
    """The rules as a SpeechModel; its styles are those of `elocute.articulation.style`."""

    name, encoder, fps = NAME, "phones", 60.0
    basis: Float32Array | None = None
    needs_sound_level, makes_contacts = False, True
    styles = tuple(STYLES)
    decoder_lookahead_s = LOOKAHEAD_S

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
    def lookahead_s(self) -> float:
        return RESAMPLING_S + phone_lookahead_s() + LOOKAHEAD_S

    def style(self, given: str | Style, *, outputs: bool = True) -> Style:
        """A Style, a name, a mix of numbers, `even`, or a .json file. Raises InputError."""
        if isinstance(given, str) and given == EVEN:
            return mix_styles(dict.fromkeys(STYLES, 1 / len(STYLES)))
        return resolve_style(given)

    def mix(self, shares: Mapping[str, float], *, outputs: bool = True) -> Style:
        """The convex mix of named styles, number by number. Raises InputError."""
        return mix_styles(dict(shares))

    def feature_streams(
        self, sample_rate: int, *, contacts: bool = True, level: SoundLevel | None = None
    ) -> FeatureStreams:
        return FeatureStreams(PhonePosteriorStream(sample_rate))

    def sound_level(self, sound: Waveform) -> None:
        """None: its front end normalises by a running mean."""

    def weights(self, speech: SpeechFeatures, style: Style, span: FrameSpan) -> Float32Array:
        """(frame, component) of every shape of the built-in head, with contacts."""
        return self.curves(speech, style, span).select(self.components).values

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

    def rig(self, head: HeadModel) -> HeadModel:
        return head


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
