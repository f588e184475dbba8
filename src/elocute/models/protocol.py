"""The protocol of all models that turn speech into motion.

A model has feature streams, which turn sound into rows of features as it comes in, and gives frames
of weights or curves for a stretch of those. A whole recording is a stream fed once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from elocute.array_types import Float32Array
from elocute.articulation.style import Style
from elocute.audio.features import Features
from elocute.audio.waveform import Waveform
from elocute.head.model import HeadModel
from elocute.motion.curves import Curves

SoundLevel = tuple[float, float]
"""Mean and peak of a whole sound."""


@dataclass(frozen=True)
class FrameSpan:
    """Frames `first` to `first + count - 1` of a take at `fps`.

    Parameters
    ----------
    first, count : int
        The first frame, and how many.
    fps : float
        Frames per second.
    """

    first: int
    count: int
    fps: float

    @classmethod
    def whole(cls, count: int, fps: float) -> FrameSpan:
        """The span of a whole take.

        Parameters
        ----------
        count : int
            Frames of the take.
        fps : float
            Frames per second.

        Returns
        -------
        FrameSpan
        """
        return cls(0, count, fps)


@dataclass(frozen=True, eq=False)
class SpeechFeatures:
    """A stretch of speech as features.

    Parameters
    ----------
    features : Features
        What the model computes its weights from.
    phones : Features, optional
        (row, 40) log-posteriors of phones at 50 Hz, where contacts and rests are made from them and
        `features` are something else.
    known : bool
        Whether the phones are known instead of recognised; in words that were not found in the
        sound they are still as heard.
    live : bool
        Whether they end where the sound is not yet known, instead of where it ends. Phones may then
        go further than the features.
    origin_s : float
        When the sound began, s: before it there is silence.
    """

    features: Features
    phones: Features | None = None
    known: bool = False
    live: bool = False
    origin_s: float = 0.0


class FeatureStream(Protocol):
    """Blocks of sound in, rows of features out, each as soon as it is certain."""

    @property
    def rate(self) -> float:
        """Rows per second; row k stands at k / rate."""
        ...

    @property
    def name(self) -> str:
        """As in `Features.encoder`."""
        ...

    def push(self, samples: Float32Array) -> Float32Array:
        """Take a block of sound (sample,), mono, full scale ±1, of any length.

        Returns
        -------
        (row, feature) float32
            The rows that are certain now, perhaps none.
        """
        ...

    def flush(self) -> Float32Array:
        """End the sound: the (row, feature) that were waiting for more of it."""
        ...


@dataclass(frozen=True, eq=False)
class FeatureStreams:
    """A model's features, and phones where it needs them besides.

    coming_phones: gives (row, 40) that are heard already behind the last row of `phones`.
    late_s: how much later than its own time a row comes, s, where frames do not wait.
    """

    features: FeatureStream
    phones: FeatureStream | None = None
    coming_phones: Callable[[], Float32Array] | None = None
    late_s: float = math.inf


class SpeechModel(Protocol):
    """A model that turns speech into motion.

    Attributes
    ----------
    name : str
        As `open_model` knows it, or the name of its file.
    encoder : str
        The encoder whose features it takes.
    styles : tuple of str
        Its speaking styles; () where it has none.
    components : tuple of str
        What `weights` weigh: shapes of the built-in head; () where it has a basis of its own.
    basis : (component, vertex, 3) float32 or None
        That basis, m; None for shapes of the built-in head.
    topology : str
        The head whose mesh it moves.
    vertex_count : int
        How many vertices that has.
    fps : float
        The frame rate of its network; frames can be asked for at any rate.
    lookahead_s : float
        How much later than a frame's own time the sound must be known, s; infinite where its
        encoder needs the whole sound first.
    decoder_lookahead_s : float
        The part of it by which features must lead a frame, s.
    live_lookahead_s : float
        The same, but for resampling, for frames of a live sound that are wanted before they are
        certain; infinite where it gives none.
    needs_sound_level : bool
        Whether it normalises by the level of the whole sound where that is known beforehand.
    makes_contacts : bool
        Whether `curves` are those of the built-in head, with closures and rests made.
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
    def live_lookahead_s(self) -> float: ...
    @property
    def needs_sound_level(self) -> bool: ...
    @property
    def makes_contacts(self) -> bool:
        """Whether `curves` are those of the built-in head, with closures and rests made."""
        ...

    def style(self, given: str | Style, *, outputs: bool = True) -> Any:
        """A style as `weights` and `curves` take it.

        Parameters
        ----------
        given : str or Style
            A name, a mix ("a:0.7,b:0.3"), "even" or a .json file; a Style for the rule-based model.
        outputs : bool
            Whether a trained model mixes the outputs of styles, as published, instead of its input.

        Raises
        ------
        ModelError
            Naming the styles that it has (InputError from the rule-based model).
        """
        ...

    def mix(self, shares: Mapping[str, float], *, outputs: bool = True) -> Any:
        """A mix of its styles, as `weights` and `curves` take it.

        Parameters
        ----------
        shares : mapping of str to float
            Share of each style; they sum to one.
        outputs : bool
            As `style` takes it.

        Raises
        ------
        ModelError
            For an unknown style.
        """
        ...

    def feature_streams(
        self,
        sample_rate: int,
        *,
        contacts: bool = True,
        level: SoundLevel | None = None,
        within_s: float | None = None,
    ) -> FeatureStreams:
        """New streams for one sound.

        Parameters
        ----------
        sample_rate : int
            Of the sound, Hz.
        contacts : bool
            Whether phones are wanted too, where `curves` makes contacts from them.
        level : (float, float), optional
            Mean and peak of the whole sound, where known.
        within_s : float, optional
            How much later than its own time a row may come, s, where rows are wanted before they
            are certain; `live_lookahead_s` at least.

        Raises
        ------
        AudioError, MachineError
            For a sample rate out of range, and a package that is missing.
        """
        ...

    def sound_level(self, sound: Waveform) -> SoundLevel | None:
        """The level that `feature_streams` takes; None unless `needs_sound_level`.

        Parameters
        ----------
        sound : Waveform
            The whole sound.

        Returns
        -------
        (float, float) or None
            Mean and peak.
        """
        ...

    def weights(self, speech: SpeechFeatures, style: Any, span: FrameSpan) -> Float32Array:
        """The network's own answer: no strength, nothing clipped.

        The rules answer with contacts and rests, in which their styles differ as well.

        Parameters
        ----------
        speech : SpeechFeatures
            Features that reach `decoder_lookahead_s` beyond the span, or to the end of the sound.
        style
            What `style` or `mix` gave.
        span : FrameSpan
            The frames wanted.

        Returns
        -------
        (frame, component) float32

        Raises
        ------
        ModelError
            For features of another size than it was trained on.
        """
        ...

    def curves(
        self,
        speech: SpeechFeatures,
        style: Any,
        span: FrameSpan,
        strength: float = 1.0,
        *,
        contacts: bool = True,
    ) -> Curves:
        """What moves a face: curves of the built-in head with contacts and rests made, or
        weights of the model's own shapes.

        Without contacts they are the model's bare output, as far as curves of the built-in head
        can hold it: within 0 to 1.

        Parameters
        ----------
        speech, style, span
            As `weights` takes them.
        strength : float
            How far the mouth moves, 0 to 2.
        contacts : bool
            Whether contacts and rests are laid over by rule, where the model makes any.

        Raises
        ------
        ModelError
            As `weights`.
        """
        ...

    def rig(self, head: HeadModel) -> HeadModel:
        """A head with the shapes that `curves` names.

        Parameters
        ----------
        head : HeadModel
            In the model's topology.

        Returns
        -------
        HeadModel

        Raises
        ------
        ModelError
            For a head of another topology.
        """
        ...
