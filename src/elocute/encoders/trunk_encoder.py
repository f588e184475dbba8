"""The speech encoder `trunk`: rows of the trunk's middle layer, from which its mouth is told."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.audio.features import Features
from elocute.audio.waveform import Waveform
from elocute.encoders.protocol import FEATURE_RATE, as_features, encoder_samples
from elocute.encoders.trunk import TrunkRows, TrunkStream, builtin_trunk


@dataclass(frozen=True)
class TrunkMiddle:
    """Rows of 512 normalised values, from the network that ships; zero where nobody speaks."""

    name: str = "trunk"
    rate: float = FEATURE_RATE

    @property
    def feature_count(self) -> int:
        return builtin_trunk().answers["hidden"]

    def __call__(self, waveform: Waveform) -> Features:
        stream = TrunkStream(builtin_trunk())
        heard = TrunkRows.joined([stream.push(encoder_samples(waveform)), stream.flush()])
        return as_features(waveform, heard.hidden, self.name)
