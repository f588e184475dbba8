"""Feature extraction: sound of any rate, in blocks of any length, to what a model answers to.

`FeatureStream`s give rows of features as soon as they are certain; `extract_features` runs them
over a whole sound, which is decoded once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from elocute.array_types import Float32Array
from elocute.articulation.known_phones import known_posteriors
from elocute.audio.band_levels import BANDS, BandLevels
from elocute.audio.features import Features
from elocute.audio.loudness import COLUMNS, ROW_RATE, Loudness
from elocute.audio.phones_and_visemes import PHONES
from elocute.audio.resampling_stream import RESAMPLING_S, ResamplingStream
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.phone_encoder import builtin_encoder
from elocute.encoders.protocol import FEATURE_RATE, Encoder
from elocute.errors import InputError
from elocute.models.protocol import FeatureStream, FeatureStreams, SpeechFeatures, SpeechModel

PhoneTimes = list[tuple[float, float, str]]
"""(start s, end s, ARPAbet phone)"""
PhoneRefiner = Callable[[Float32Array, float], Float32Array]
"""Takes the encoder's log-posteriors (row, 40) of a whole sound and its duration in s; gives better
ones."""


class PhonePosteriorStream:
    """Log-posteriors (row, 40) of the built-in phone encoder at 50 Hz."""

    name, rate = "phones", FEATURE_RATE

    def __init__(self, sample_rate: int) -> None:
        self._resampled = ResamplingStream(sample_rate, SPEECH_RATE)
        self._stream = builtin_encoder().stream()

    @property
    def lookahead_s(self) -> float:
        """How much later than its own time a row comes, s."""
        return RESAMPLING_S + phone_lookahead_s()

    def push(self, samples: Float32Array) -> Float32Array:
        return self._stream.push(self._resampled.push(samples))

    def flush(self) -> Float32Array:
        rest = self._stream.push(self._resampled.push(np.zeros(0, np.float32), last=True))
        return np.concatenate([rest, self._stream.flush()])


class VoiceSoundStream:
    """Loudness and spectrum at 50 Hz: the columns of `Loudness`, then those of `BandLevels`."""

    name, rate = "loudness and bands", ROW_RATE

    def __init__(self, sample_rate: int) -> None:
        self._resampled = ResamplingStream(sample_rate, SPEECH_RATE)
        self._loudness, self._bands = Loudness(), BandLevels()
        self._louder = np.zeros((0, COLUMNS), np.float32)
        self._coloured = np.zeros((0, BANDS), np.float32)

    def push(self, samples: Float32Array) -> Float32Array:
        return self._heard(self._resampled.push(samples))

    def flush(self) -> Float32Array:
        rest = self._heard(self._resampled.push(np.zeros(0, np.float32), last=True))
        last = self._joined(self._loudness.flush(), self._bands.flush())
        return np.concatenate([rest, last])

    def _heard(self, samples: Float32Array) -> Float32Array:
        return self._joined(self._loudness.push(samples), self._bands.push(samples))

    def _joined(self, louder: Float32Array, coloured: Float32Array) -> Float32Array:
        """Rows that are certain in both."""
        louder = np.concatenate([self._louder, louder])
        coloured = np.concatenate([self._coloured, coloured])
        count = min(len(louder), len(coloured))
        self._louder, self._coloured = louder[count:], coloured[count:]
        return np.concatenate([louder[:count], coloured[:count]], axis=1)


class KnownPhoneStream:
    """Log-posteriors of phones whose times are known; all rows come with `flush`.

    `flush` raises InputError for an unknown phone.
    """

    name, rate = "phones", FEATURE_RATE

    def __init__(self, sample_rate: int, phones: PhoneTimes) -> None:
        self._sample_rate, self._phones, self._samples = sample_rate, phones, 0

    def push(self, samples: Float32Array) -> Float32Array:
        self._samples += len(samples)
        return np.zeros((0, len(PHONES)), np.float32)

    def flush(self) -> Float32Array:
        seconds = self._samples / self._sample_rate
        return known_posteriors(self._phones, seconds)


class RefinedPhoneStream:
    """Log-posteriors of the built-in phone encoder, refined; all rows come with `flush`.

    `flush` raises what the refiner raises.
    """

    name, rate = "phones", FEATURE_RATE

    def __init__(self, sample_rate: int, refine: PhoneRefiner) -> None:
        self._sample_rate, self._refine, self._samples = sample_rate, refine, 0
        self._heard = PhonePosteriorStream(sample_rate)
        self._rows: list[Float32Array] = []

    def push(self, samples: Float32Array) -> Float32Array:
        self._samples += len(samples)
        self._rows.append(self._heard.push(samples))
        return np.zeros((0, len(PHONES)), np.float32)

    def flush(self) -> Float32Array:
        heard = np.concatenate([*self._rows, self._heard.flush()])
        return self._refine(heard, self._samples / self._sample_rate)


class WholeSoundStream:
    """Features of an encoder that needs the whole sound; all rows come with `flush`."""

    def __init__(self, sample_rate: int, encoder: Encoder) -> None:
        self._sample_rate, self._encoder = sample_rate, encoder
        self._blocks: list[Float32Array] = []

    @property
    def name(self) -> str:
        return self._encoder.name

    @property
    def rate(self) -> float:
        return self._encoder.rate

    def push(self, samples: Float32Array) -> Float32Array:
        self._blocks.append(np.array(samples, np.float32))
        return np.zeros((0, self._encoder.feature_count), np.float32)

    def flush(self) -> Float32Array:
        sound = Waveform(np.concatenate(self._blocks), self._sample_rate)
        return self._encoder(sound).values


def phone_lookahead_s() -> float:
    """How much sound after a row of phones the encoder waits for, a row included."""
    return builtin_encoder().lookahead_s + 1 / FEATURE_RATE


BLOCK_S = 300.0
"""Seconds of a sound in memory that are made into features at once."""
Progress = Callable[[float], None]
"""Called with the share of the work done, 0…1."""


@dataclass(frozen=True, eq=False)
class SoundBlocks:
    """A sound that is read once, block by block.

    Parameters
    ----------
    sample_rate : int
        Hz.
    blocks : iterable of ((sample,) float32, float)
        Each block, and the share of the whole that ends with it.
    """

    sample_rate: int
    blocks: Iterable[tuple[Float32Array, float]]


def blocks_of(sound: Waveform) -> SoundBlocks:
    """A sound in memory as blocks: a long one in several, since features take more memory.

    Parameters
    ----------
    sound : Waveform
        The sound.

    Returns
    -------
    SoundBlocks
    """
    size, total = round(BLOCK_S * sound.sample_rate), len(sound.samples)
    blocks = [
        (sound.samples[first : first + size], min(1.0, (first + size) / total))
        for first in range(0, total, size)
    ]
    return SoundBlocks(sound.sample_rate, blocks)


def extract_features(
    model: SpeechModel,
    sound: Waveform | SoundBlocks,
    *,
    contacts: bool = True,
    phones: PhoneTimes | PhoneRefiner | None = None,
    progress: Progress | None = None,
) -> tuple[SpeechFeatures, float]:
    """The features of a whole sound, as a model needs them.

    Parameters
    ----------
    model : SpeechModel
        Whose features.
    sound : Waveform or SoundBlocks
        The sound.
    contacts : bool
        Whether phones are wanted too, where `curves` makes contacts from them.
    phones : list of (float, float, str) or callable, optional
        Start in s, end in s and ARPAbet phone, where known; used instead of the encoder's. Or a
        function that takes the encoder's log-posteriors and the duration, and gives better ones.
    progress : callable, optional
        Called with the share of the sound that is done, 0 to 1.

    Returns
    -------
    features : SpeechFeatures
    duration_s : float
        Of the sound.

    Raises
    ------
    AudioError, ModelError, MachineError
        For sound, a model or a package that cannot be used.
    InputError
        For phones beside a model that computes nothing from phones.
    """
    source = blocks_of(sound) if isinstance(sound, Waveform) else sound
    level = None
    if model.needs_sound_level:
        whole = Waveform(np.concatenate([block for block, _ in source.blocks]), source.sample_rate)
        source, level = blocks_of(whole), model.sound_level(whole)
    streams = model.feature_streams(source.sample_rate, contacts=contacts, level=level)
    if phones is not None:
        streams = _with_phones(model, streams, _phone_stream(source.sample_rate, phones))
    used = [stream for stream in (streams.features, streams.phones) if stream is not None]
    rows: list[list[Float32Array]] = [[] for _ in used]
    samples = 0
    for block, share in source.blocks:
        samples += len(block)
        for stream, given in zip(used, rows, strict=True):
            given.append(stream.push(block))
        if progress:
            progress(share)
    features = [
        Features(np.concatenate([*given, stream.flush()]), stream.rate, stream.name)
        for stream, given in zip(used, rows, strict=True)
    ]
    speech = SpeechFeatures(
        features[0], features[-1] if streams.phones is not None else None, known=phones is not None
    )
    return speech, samples / source.sample_rate


def _phone_stream(sample_rate: int, phones: PhoneTimes | PhoneRefiner) -> FeatureStream:
    """A stream of what is known, or of what is made of what the encoder recognises."""
    if callable(phones):
        return RefinedPhoneStream(sample_rate, phones)
    return KnownPhoneStream(sample_rate, phones)


def _with_phones(
    model: SpeechModel, streams: FeatureStreams, phones: FeatureStream
) -> FeatureStreams:
    """The same streams, but with other phones. Raises InputError where nothing takes them."""
    if streams.features.name == "phones":
        streams = replace(streams, features=phones)
    elif streams.phones is None:
        raise InputError.about(
            "phones",
            found=f"the model {model.name}, which takes {streams.features.name} alone",
            allowed="a model that takes phones, or one whose contacts are made from them",
            remedy="leave out phones and text, or choose the model articulation",
        )
    return streams if streams.phones is None else replace(streams, phones=phones)
