"""The two encoders that need no file of the user's: `phones` and `fbank`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.audio.features import Features
from elocute.audio.phones import PHONES
from elocute.audio.spectral import fbank
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.encoder import FEATURE_RATE, features_of, heard
from elocute.encoders.phone_encoder import builtin_encoder

FBANK_BANDS = 26
FBANK_RATE = 100.0


@dataclass(frozen=True)
class Phones:
    """Log-posteriors of forty phones, from the network that ships."""

    name: str = "phones"
    feature_count: int = len(PHONES)
    rate: float = FEATURE_RATE

    def __call__(self, waveform: Waveform) -> Features:
        return features_of(waveform, builtin_encoder().encode(heard(waveform)), self.name)


@dataclass(frozen=True)
class Fbank:
    """Natural logarithms of 26 mel-filterbank energies: VOCA's ablation (2019, section 6).

    25 ms windows every 10 ms of sound with full scale ±1, as python_speech_features' logfbank.
    """

    name: str = "fbank"
    feature_count: int = FBANK_BANDS
    rate: float = FEATURE_RATE

    def __call__(self, waveform: Waveform) -> Features:
        energies = fbank(heard(waveform), SPEECH_RATE, FBANK_BANDS)
        at_50_hz = Features(energies.astype(np.float32), FBANK_RATE, self.name).resample(
            FEATURE_RATE
        )
        return features_of(waveform, at_50_hz.values, self.name)
