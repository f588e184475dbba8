"""Feature extraction: sound of any rate, in blocks of any length, to what a model answers to.

`FeatureStream`s give rows of features as soon as they are certain; `extract_features` runs them
over a whole sound, which is decoded once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.features import Features
from elocute.audio.resampling_stream import ResamplingStream
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.phones_and_visemes import PHONES, SILENCE
from elocute.encoders.protocol import FEATURE_RATE, Encoder
from elocute.encoders.trunk import (
    WHOLE,
    Pace,
    TrunkNetwork,
    TrunkRows,
    TrunkStream,
    builtin_trunk,
)
from elocute.errors import InputError
from elocute.models.protocol import FeatureStream, FeatureStreams, SpeechFeatures, SpeechModel
from elocute.speech.text.known_phones import known_posteriors
from elocute.speech.times.labels import Label, PhoneRefiner


class Hearing:
    """One pass of a trunk over a sound; its phones are kept as a stream where they are wanted."""

    def __init__(
        self,
        network: TrunkNetwork,
        sample_rate: int,
        *,
        phones: bool = True,
        pace: Pace = WHOLE,
    ) -> None:
        self._resampled = ResamplingStream(sample_rate, SPEECH_RATE, prompt=pace != WHOLE)
        self._kept = phones
        self._trunk = TrunkStream(network, pace)
        self.phones = HeardPhones()

    def push(self, samples: Float32Array) -> TrunkRows:
        """Take a block of sound; the rows that are certain now."""
        return self._answered(self._trunk.push(self._resampled.push(samples)))

    def coming_phones(self) -> Float32Array:
        """(row, 40) log-posteriors of what comes behind the last row that was given."""
        return self._trunk.coming_phones

    def flush(self) -> TrunkRows:
        """End the sound: the rows that were waiting for more of it."""
        rest = self._trunk.push(self._resampled.push(np.zeros(0, np.float32), last=True))
        return self._answered(TrunkRows.joined([rest, self._trunk.flush()]))

    def _answered(self, rows: TrunkRows) -> TrunkRows:
        if self._kept:
            self.phones.take(rows.phones)
        return rows


class HeardPhones:
    """Log-posteriors (row, 40) that a `Hearing` heard in the blocks it was pushed before."""

    name, rate = "phones", FEATURE_RATE

    def __init__(self) -> None:
        self._rows: list[Float32Array] = []

    def take(self, rows: Float32Array) -> None:
        """Keep rows until they are asked for."""
        self._rows.append(rows)

    def push(self, samples: Float32Array) -> Float32Array:
        """What was heard since the last call; the samples themselves are not heard again."""
        return self.flush()

    def flush(self) -> Float32Array:
        rows = np.concatenate([np.zeros((0, len(PHONES)), np.float32), *self._rows])
        self._rows.clear()
        return rows


class HeardMouth:
    """(row, 8): the mouth's fields of a `Hearing`, and the share of silence, 1 without sound."""

    name, rate = "mouth", FEATURE_RATE

    def __init__(self, hearing: Hearing) -> None:
        self._hearing = hearing

    def push(self, samples: Float32Array) -> Float32Array:
        return self._features(self._hearing.push(samples))

    def flush(self) -> Float32Array:
        return self._features(self._hearing.flush())

    @staticmethod
    def _features(rows: TrunkRows) -> Float32Array:
        silence = np.where(rows.hidden.any(axis=1), np.exp(rows.phones[:, SILENCE]), np.float32(1))
        return np.column_stack([rows.mouth, silence]).astype(np.float32)


class HeardMiddle(HeardMouth):
    """(row, 512): the trunk's middle layer, which the mouth is predicted from beside the last."""

    name = "trunk"

    @staticmethod
    def _features(rows: TrunkRows) -> Float32Array:
        return rows.hidden


class PhonePosteriorStream:
    """Log-posteriors (row, 40) of phones at 50 Hz, where nothing else of the trunk is wanted."""

    name, rate = "phones", FEATURE_RATE

    def __init__(self, sample_rate: int) -> None:
        self._hearing = Hearing(builtin_trunk(), sample_rate)

    def push(self, samples: Float32Array) -> Float32Array:
        self._hearing.push(samples)
        return self._hearing.phones.flush()

    def flush(self) -> Float32Array:
        self._hearing.flush()
        return self._hearing.phones.flush()


class KnownPhoneStream:
    """Log-posteriors of phones whose times are known; all rows come with `flush`.

    `flush` raises InputError for an unknown phone.
    """

    name, rate = "phones", FEATURE_RATE

    def __init__(self, sample_rate: int, phones: list[Label]) -> None:
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


BLOCK_S = 300.0
"""Seconds of a sound in memory that are made into features at once."""
Progress = Callable[[float], None]
"""Called with the share of the work done, 0…1."""


@dataclass(frozen=True, eq=False)
class SoundBlocks:
    """A sound that is read once, block by block.

    Each block (sample,) comes with the share of the whole that ends with it.
    """

    sample_rate: int
    blocks: Iterable[tuple[Float32Array, float]]


def blocks_of(sound: Waveform) -> SoundBlocks:
    """A sound in memory as blocks: a long one in several, since features take more memory."""
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
    phones: list[Label] | PhoneRefiner | None = None,
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
        for stream, pushed in zip(used, rows, strict=True):
            pushed.append(stream.push(block))
        if progress:
            progress(share)
    features = [
        Features(np.concatenate([*pushed, stream.flush()]), stream.rate, stream.name)
        for stream, pushed in zip(used, rows, strict=True)
    ]
    speech = SpeechFeatures(
        features[0], features[-1] if streams.phones is not None else None, known=phones is not None
    )
    return speech, samples / source.sample_rate


def _phone_stream(sample_rate: int, phones: list[Label] | PhoneRefiner) -> FeatureStream:
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
