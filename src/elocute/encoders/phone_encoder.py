"""The encoders `phones` (the trunk's phone posteriors) and `trunk` (its middle layer)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.features import Features
from elocute.audio.waveform import Waveform
from elocute.encoders.phones_and_visemes import PHONES
from elocute.encoders.protocol import FEATURE_RATE, as_features, encoder_samples
from elocute.encoders.trunk import (
    WHOLE,
    Pace,
    TrunkNetwork,
    TrunkRows,
    TrunkStream,
    builtin_trunk,
    trunk_lookahead_s,
)


class PhoneEncoder:
    """The phones of a trunk.

    Parameters
    ----------
    path : str or Path, optional
        The trunk's file; the shipped one by default.
    pace : Pace
        How soon it answers.

    Raises
    ------
    ModelError
        When it is first used: for a file that is missing or no trunk.
    """

    def __init__(self, path: str | Path | None = None, pace: Pace = WHOLE) -> None:
        self.pace = pace
        self.network = builtin_trunk() if path is None else TrunkNetwork(path)

    @property
    def lookahead_s(self) -> float:
        """How much later than an output's own time the sound must be known."""
        return trunk_lookahead_s(self.network, self.pace)

    def encode(self, samples: Float32Array) -> Float32Array:
        """(sample,) at 16 kHz to (ceil(sample / 320), 40) log-posteriors at 50 Hz."""
        stream = self.stream()
        return np.concatenate([stream.push(samples), stream.flush()])

    def stream(self) -> PhoneStream:
        """The same in pieces."""
        return PhoneStream(TrunkStream(self.network, self.pace))


class PhoneStream:
    """Push sound, take log-posteriors as soon as their look-ahead is known; flush at the end."""

    def __init__(self, trunk: TrunkStream) -> None:
        self._trunk = trunk

    def push(self, samples: Float32Array) -> Float32Array:
        """(sample,) at 16 kHz; returns the (frame, 40) that are now certain."""
        return self._trunk.push(samples).phones

    def flush(self) -> Float32Array:
        """The remaining frames."""
        return self._trunk.flush().phones


@cache
def builtin_encoder() -> PhoneEncoder:
    """The shipped encoder, loaded once per process."""
    return PhoneEncoder()


@dataclass(frozen=True)
class PhonePosteriors:
    """Log-posteriors of forty phones, from the network that ships."""

    name: str = "phones"
    feature_count: int = len(PHONES)
    rate: float = FEATURE_RATE

    def __call__(self, waveform: Waveform) -> Features:
        return as_features(waveform, builtin_encoder().encode(encoder_samples(waveform)), self.name)


@dataclass(frozen=True)
class TrunkMiddle:
    """Rows of 512 normalised values of the middle layer; zero in silence."""

    name: str = "trunk"
    rate: float = FEATURE_RATE

    @property
    def feature_count(self) -> int:
        return builtin_trunk().answers["hidden"]

    def __call__(self, waveform: Waveform) -> Features:
        stream = TrunkStream(builtin_trunk())
        heard = TrunkRows.joined([stream.push(encoder_samples(waveform)), stream.flush()])
        return as_features(waveform, heard.hidden, self.name)
