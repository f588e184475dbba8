"""The speech encoder `fbank`: plain mel-filterbank energies, no network."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.audio.features import Features
from elocute.audio.spectral import fbank
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.protocol import FEATURE_RATE, as_features, encoder_samples

FBANK_BANDS = 26
FBANK_RATE = 100.0


@dataclass(frozen=True)
class FilterbankEnergies:
    """Natural logarithms of 26 mel-filterbank energies: VOCA's ablation (2019, section 6).

    25 ms windows every 10 ms of sound with full scale ±1, as python_speech_features' logfbank.
    """

    name: str = "fbank"
    feature_count: int = FBANK_BANDS
    rate: float = FEATURE_RATE

    def __call__(self, waveform: Waveform) -> Features:
        energies = fbank(encoder_samples(waveform), SPEECH_RATE, FBANK_BANDS)
        at_50_hz = Features(energies.astype(np.float32), FBANK_RATE, self.name).resample(
            FEATURE_RATE
        )
        return as_features(waveform, at_50_hz.values, self.name)
