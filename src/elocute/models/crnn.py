"""A trained recurrent model at run time: its network takes the sound itself; it has no styles.

In the built-in topology its shapes become the head's curves by bounded least squares, so contacts,
rests and exporters follow as for every other model.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from elocute.array_types import Float32Array
from elocute.articulation.driver import LOOKAHEAD_S
from elocute.articulation.style import Style
from elocute.audio.mel_with_deltas import HOP, RATE
from elocute.audio.resampling_stream import RESAMPLING_S
from elocute.audio.sound_level import sound_level
from elocute.audio.waveform import Waveform
from elocute.encoders.trunk import builtin_trunk, trunk_lookahead_s
from elocute.errors import ModelError
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.models.crnn_network import (
    MEL,
    OWN_COLUMN,
    SHIPPED,
    WINDOW_COLUMNS,
    CrnnNetwork,
    CrnnStream,
)
from elocute.models.feature_extraction import Hearing, PhonePosteriorStream
from elocute.models.finishing import finished_curves
from elocute.models.model_shapes import as_builtin, speech_names, with_own_shapes
from elocute.models.protocol import FeatureStreams, FrameSpan, SoundLevel, SpeechFeatures
from elocute.motion.curves import Curves
from elocute.numerics.resampling import frame_places, read_rows

COLUMN_S = HOP / RATE


class CrnnModel:
    """The recurrent model that ships (`crnn`), or a trained one from an .onnx, as a SpeechModel.

    A session may be given where the file was opened before.

    Raises
    ------
    ModelError
        For a file that is missing or too large; when the network is first used, for one that is
        not a recurrent model of Elocute.
    """

    styles: tuple[str, ...] = ()
    components: tuple[str, ...] = ()
    live_lookahead_s = math.inf

    def __init__(self, path: str | Path = SHIPPED, session: Any = None) -> None:
        self.network = CrnnNetwork(path, session)
        self.path = self.network.path

    @property
    def name(self) -> str:
        return self.path.name

    @property
    def encoder(self) -> str:
        return self.network.record.encoder

    @property
    def needs_sound_level(self) -> bool:
        return self.encoder == MEL

    @property
    def basis(self) -> Float32Array:
        return self.network.basis

    @property
    def topology(self) -> str:
        return self.network.record.topology

    @property
    def vertex_count(self) -> int:
        return self.network.record.vertices

    @property
    def fps(self) -> float:
        return self.network.record.fps

    @property
    def makes_contacts(self) -> bool:
        return self.topology == load_builtin_head().name

    @property
    def decoder_lookahead_s(self) -> float:
        between_s = 2 / self.fps
        return max(between_s, LOOKAHEAD_S) if self.makes_contacts else between_s

    @property
    def lookahead_s(self) -> float:
        features_s = WINDOW_COLUMNS * COLUMN_S
        if self.encoder != MEL:
            later = WINDOW_COLUMNS - OWN_COLUMN[self.encoder]
            features_s = later * COLUMN_S + trunk_lookahead_s()
        elif self.makes_contacts:
            features_s = max(features_s, trunk_lookahead_s())
        return RESAMPLING_S + features_s + self.decoder_lookahead_s

    def style(self, given: str | Style, *, outputs: bool = True) -> None:
        """None: only `plain` is allowed. Raises ModelError."""
        if given != "plain":
            shown = given if isinstance(given, str) else "with numbers"
            raise ModelError.about(
                f"style {shown}", found=f"{self.name} has no styles", allowed="plain"
            )

    def mix(self, shares: Mapping[str, float], *, outputs: bool = True) -> None:
        """Raises ModelError: it has no styles."""
        raise ModelError.about(
            f"a mix of {len(shares)} styles",
            found=f"{self.name} has no styles",
            allowed="a model with styles: articulation, voca",
        )

    def feature_streams(
        self,
        sample_rate: int,
        *,
        contacts: bool = True,
        level: SoundLevel | None = None,
        within_s: float | None = None,
    ) -> FeatureStreams:
        contacts = contacts and self.makes_contacts
        if self.encoder == MEL:
            own = CrnnStream(self.network, sample_rate, level=level)
            return FeatureStreams(own, PhonePosteriorStream(sample_rate) if contacts else None)
        hearing = Hearing(builtin_trunk(), sample_rate, phones=contacts)
        own = CrnnStream(self.network, sample_rate, hearing=hearing)
        return FeatureStreams(own, hearing.phones if contacts else None)

    def sound_level(self, sound: Waveform) -> SoundLevel | None:
        """Mean and peak of the sound at the network's own rate."""
        return sound_level(sound, RATE) if self.needs_sound_level else None

    def weights(self, speech: SpeechFeatures, style: None, span: FrameSpan) -> Float32Array:
        """(frame, component) on `basis`."""
        features = speech.features
        places = frame_places(span.first, span.count, features.rate, span.fps)
        return read_rows(features.values, places - features.first)

    def curves(
        self,
        speech: SpeechFeatures,
        style: None,
        span: FrameSpan,
        strength: float = 1.0,
        *,
        contacts: bool = True,
    ) -> Curves:
        """Curves 0…1 of the built-in head, or weights of its own shapes."""
        if not self.makes_contacts:
            weights = self.weights(speech, style, span)
            return Curves(weights * np.float32(strength), self._own_names, span.fps)
        rows = _near(speech, span)
        built = replace(rows.features, values=as_builtin(rows.features.values, self.basis))
        values = self.weights(SpeechFeatures(built), style, span)
        bare = Curves(np.clip(values * strength, 0, 1), speech_names(), span.fps)
        return finished_curves(bare, speech.phones if contacts else None, span)

    def rig(self, head: HeadModel) -> HeadModel:
        """Raises ModelError for a head of another topology than it was trained in."""
        if self.makes_contacts:
            return head
        return with_own_shapes(head, self.basis, self._own_names, self.path)

    @property
    def _own_names(self) -> tuple[str, ...]:
        return tuple(f"speech{index:03d}" for index in range(len(self.basis)))


def _near(speech: SpeechFeatures, span: FrameSpan) -> SpeechFeatures:
    """Only the rows between which the frames of a span lie."""
    features = speech.features
    places = frame_places(span.first, span.count, features.rate, span.fps) - features.first
    last = len(features.values) - 1
    low, high = min(int(places[0]), last), min(int(places[-1]) + 2, last + 1)
    near = replace(features, values=features.values[low:high], first=features.first + low)
    return SpeechFeatures(near)
