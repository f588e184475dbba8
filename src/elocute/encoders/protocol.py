"""The protocol of all speech encoders: a callable from Waveform to Features at 50 Hz."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from elocute.audio.features import Features
from elocute.audio.waveform import SPEECH_RATE, Waveform

FEATURE_RATE = 50.0
"""Hz; frame k stands at k / 50 s."""
WEIGHTS_MAX_BYTES = 8_000_000_000
"""Of the weights that an encoder from elsewhere may have."""


class Encoder(Protocol):
    """A speech encoder: a callable from Waveform to Features.

    It gives round(50 · duration) rows, at least one.

    Attributes
    ----------
    name : str
        What `Features.encoder` says.
    feature_count : int
        Features per row.
    rate : float
        Rows per second.
    """

    @property
    def name(self) -> str:
        """As in `Features.encoder`."""
        ...

    @property
    def feature_count(self) -> int: ...

    @property
    def rate(self) -> float:
        """Frames per second."""
        ...

    def __call__(self, waveform: Waveform) -> Features: ...


def encoder_samples(waveform: Waveform) -> NDArray[np.float32]:
    """(sample,) float32 at 16 kHz, full scale ±1."""
    return waveform.resample(SPEECH_RATE).samples


def as_features(waveform: Waveform, values: NDArray[np.floating], name: str) -> Features:
    """Values (frame, feature) at 50 Hz as Features of exactly the sound's duration.

    Front ends differ by a frame at the end: what is missing repeats the last frame, as linear
    interpolation beyond the end does; what is too much is cut.
    """
    count = max(1, round(len(waveform.samples) * FEATURE_RATE / waveform.sample_rate))
    short = max(0, count - len(values))
    return Features(np.pad(values[:count], ((0, short), (0, 0)), "edge"), FEATURE_RATE, name)
