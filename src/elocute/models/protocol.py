"""What a model that turns speech into motion is: one protocol for all of them.

A model has feature streams, which turn sound into rows of features as it comes in, and gives frames
of weights or curves for a stretch of those. A whole recording is a stream fed once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from elocute.articulation.style import Style
from elocute.audio.features import Features
from elocute.audio.waveform import Waveform
from elocute.head.model import HeadModel
from elocute.motion.curves import Curves

Float32Array = NDArray[np.float32]
SoundLevel = tuple[float, float]
"""Mean and peak of a whole sound."""


@dataclass(frozen=True)
class FrameSpan:
    """Frames `first` … `first + count - 1` at `fps`; `total` frames in the whole take."""

    first: int
    count: int
    fps: float
    total: int | None = None

    @classmethod
    def whole(cls, count: int, fps: float) -> FrameSpan:
        """All frames of a take."""
        return cls(0, count, fps, count)


@dataclass(frozen=True, eq=False)
class SpeechFeatures:
    """A stretch of speech as features.

    features  what the model computes its weights from
    phones    (row, 40) log-posteriors at 50 Hz, where contacts and rests are made from them
    """

    features: Features
    phones: Features | None = None


class FeatureStream(Protocol):
    """Sound in, rows of features out, each as soon as it is certain."""

    @property
    def rate(self) -> float:
        """Rows per second; row k stands at k / rate."""
        ...

    @property
    def name(self) -> str:
        """What Features.encoder says."""
        ...

    def push(self, samples: Float32Array) -> Float32Array:
        """(sample,) to the (row, feature) that are certain now, perhaps none."""
        ...

    def flush(self) -> Float32Array:
        """The rows that were waiting for more sound."""
        ...


@dataclass(frozen=True, eq=False)
class FeatureStreams:
    """A model's features, and phones where it needs them besides."""

    features: FeatureStream
    phones: FeatureStream | None = None


class SpeechModel(Protocol):
    """Speech to motion.

    name          as `open_model` knows it, or the file's name
    encoder       the name of the encoder whose features it takes
    styles        names of its speaking styles, () where it has none
    components    names of what `weights` weigh, () where it has a basis of its own
    basis         (component, vertex, 3) m of its own, or None for shapes of the built-in head
    topology      the head whose mesh it moves, and how many vertices that has
    fps           frames per second at which it thinks; it answers at any rate
    lookahead_s   how much later than a frame's own time the sound must be known; infinite where
                  its encoder wants the whole sound first
    needs_sound_level
                  whether the level of the whole sound, where it is known beforehand, helps
    """

    @property
    def name(self) -> str: ...
    @property
    def encoder(self) -> str: ...
    @property
    def styles(self) -> tuple[str, ...]: ...
    @property
    def components(self) -> tuple[str, ...]: ...
    @property
    def basis(self) -> Float32Array | None: ...
    @property
    def topology(self) -> str: ...
    @property
    def vertex_count(self) -> int: ...
    @property
    def fps(self) -> float: ...
    @property
    def lookahead_s(self) -> float: ...
    @property
    def decoder_lookahead_s(self) -> float:
        """The part of `lookahead_s` by which features must lead a frame."""
        ...

    @property
    def needs_sound_level(self) -> bool: ...
    @property
    def makes_contacts(self) -> bool:
        """Whether `curves` are those of the built-in head, with closures and rests made."""
        ...

    def style(self, given: str | Style) -> Any:
        """A style as `weights` and `curves` take it, from a name, a mix, `even` or a .json file.

        Raises ModelError (InputError for the rules) naming what is allowed.
        """
        ...

    def mix(self, shares: Mapping[str, float]) -> Any:
        """The same from shares of its styles. Raises ModelError for one that it has not."""
        ...

    def feature_streams(
        self, sample_rate: int, *, contacts: bool = True, level: SoundLevel | None = None
    ) -> FeatureStreams:
        """New streams for sound of this rate; without `contacts` only what `weights` need.

        level  of the whole sound, where it is known. Raises AudioError, MachineError.
        """
        ...

    def sound_level(self, sound: Waveform) -> SoundLevel | None:
        """The level that `feature_streams` takes, for a model that `needs_sound_level`."""
        ...

    def weights(self, speech: SpeechFeatures, style: Any, span: FrameSpan) -> Float32Array:
        """(frame, component) as the model has them: no blinks, no strength, nothing clipped.

        Raises ModelError for features of another size than it was trained on.
        """
        ...

    def curves(
        self,
        speech: SpeechFeatures,
        style: Any,
        span: FrameSpan,
        strength: float = 1.0,
        *,
        blinks: bool = True,
    ) -> Curves:
        """What moves a face: for the built-in head with contacts, rests and blinks made, else
        weights of the model's own shapes, scaled. Raises ModelError as `weights`.
        """
        ...

    def rig(self, head: HeadModel) -> HeadModel:
        """`head` with the shapes that `curves` name. Raises ModelError for another topology."""
        ...
