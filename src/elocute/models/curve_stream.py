"""Live curves of any model: blocks of sound in, curves out, each frame as soon as it is certain.

Features are kept for `HISTORY_S` behind the last frame, so that memory stays bounded; a frame is
computed from that stretch exactly as it would be from the whole sound. With a `lookahead` frames do
not wait for all that bears on them: each is made from what is known so far, and is not taken back.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.articulation.driver import HISTORY_S
from elocute.articulation.settings import AnimationSettings, lays_contacts, mixes_outputs
from elocute.articulation.style import Style
from elocute.audio.features import Features
from elocute.audio.pcm import CHANNELS_MAX, INT16
from elocute.audio.resampling_stream import resampling_s
from elocute.audio.waveform import SPEECH_RATE, check_rate, check_samples
from elocute.errors import AudioError, InputError
from elocute.models.expected_phones import ExpectedPhones
from elocute.models.protocol import (
    FeatureStream,
    FrameSpan,
    SoundLevel,
    SpeechFeatures,
    SpeechModel,
)
from elocute.models.style_mixes import checked_style
from elocute.motion.curves import Curves
from elocute.numerics.frame_rates import frame_rate
from elocute.numerics.input_checks import NUMBERS_MAX, array_of, real_number
from elocute.numerics.resampling import frames_in
from elocute.one_line_repr import brief
from elocute.speech.times.labels import Label

EXACT = "exact"
LOOKAHEAD_MAX_S = 10.0  # nobody waits longer for an answer
PIECES_PER_S = 50  # as many as rows of the trunk


class CurveStream:
    """Live curves of any model: `push` sound, get the frames that are certain.

    Several threads may push; a block is taken whole before the next one. Style, strength and mix
    are as `animate` takes them; with contacts "off" the model's bare output comes. The level is
    mean and peak of the whole sound: a model that normalises by them then gives what the whole
    sound gives; without, it goes by the sound so far. The look-ahead says how much later than its
    time a frame comes, s; "exact" waits for all that bears on it.

    Raises
    ------
    InputError
        For settings out of range, and for a style that the model does not have.
    """

    def __init__(
        self,
        model: SpeechModel,
        sample_rate: int,
        *,
        fps: float = 60.0,
        style: str | Style = "plain",
        strength: float = 1.0,
        level: SoundLevel | None = None,
        contacts: str = "auto",
        mix: str = "output",
        lookahead: float | str = EXACT,
    ) -> None:
        AnimationSettings(fps=fps, strength=strength, contacts=contacts, mix=mix)
        self._contacts = lays_contacts(contacts)
        self.model, self.fps = model, float(frame_rate(fps))
        self.sample_rate = check_rate("stream", sample_rate)
        self._style = model.style(checked_style(style), outputs=mixes_outputs(mix))
        self._strength = strength
        _check_level(level)
        self._lookahead_s = _live_lookahead(model, self.sample_rate, lookahead)
        self._level = level
        self._expected = ExpectedPhones()
        self._samples = self._frames = 0
        self._ended = False
        self._lock = threading.RLock()
        self._hear_from(0.0)

    def _hear_from(self, origin_s: float) -> None:
        """Begin to hear at a moment that all features have a row at."""
        streams = self.model.feature_streams(
            self.sample_rate,
            contacts=self._contacts,
            level=self._level,
            within_s=self._lookahead_s,
        )
        self._waiting_s = self.model.decoder_lookahead_s
        if self._lookahead_s is not None:
            self._waiting_s = self._lookahead_s - streams.late_s
        self._origin_s, self._coming_phones = origin_s, streams.coming_phones
        parts = [part for part in (streams.features, streams.phones) if part is not None]
        self._features, *phones = (_FeatureBuffer(part, origin_s) for part in parts)
        self._phones = phones[0] if phones else None

    @property
    def lookahead_s(self) -> float:
        """How much sound after its own time a frame waits for, s."""
        return self.model.lookahead_s if self._lookahead_s is None else self._lookahead_s

    @property
    def is_live(self) -> bool:
        """Whether frames are made from what is known so far."""
        return self._lookahead_s is not None

    @property
    def frames_given(self) -> int:
        """How many frames `push` and `flush` gave so far; the next one's time is that / fps."""
        return self._frames

    @property
    def samples_taken(self) -> int:
        """How many samples `push` took so far."""
        return self._samples

    def push(self, samples: NDArray[np.floating] | NDArray[np.int16]) -> Curves | None:
        """Take a block of sound (sample,) of floats within ±1 or int16, of any length.

        The frames that are certain now come back, or None where there is none. Raises AudioError
        for anything else, and after `flush`.
        """
        with self._lock:
            if self._ended:
                raise AudioError("stream: found sound after its end; allowed: a new stream")
            block = checked_block(samples, self.sample_rate, self._samples)
            if not self.is_live:
                return self._heard(block)
            # Each piece gives one row or none, so that a frame knows as much however sound is cut.
            size = self.sample_rate // PIECES_PER_S
            pieces = np.split(block, range(size - self._samples % size, len(block), size))
            parts = [each for piece in pieces if (each := self._heard(piece)) is not None]
            if not parts:
                return None
            return replace(parts[0], values=np.concatenate([each.values for each in parts]))

    def _heard(self, block: Float32Array) -> Curves | None:
        """The frames that are certain, or can be made, with another block."""
        self._samples += len(block)
        for buffer in self._buffers:
            buffer.push(block)
        certain_s = min(buffer.known_s for buffer in self._buffers) - self._waiting_s
        count = math.floor(certain_s * self.fps) + 1 - self._frames
        return self._answer(count) if count > 0 else None

    def expect(self, phones: Sequence[Label]) -> None:
        """Phones of the sound that comes, in s after the last sample that was pushed.

        Raises InputError as `animate` does for phones.
        """
        with self._lock:
            buffer = self._phones or self._features
            if buffer.name != "phones":
                raise InputError.about(
                    "phones",
                    found=f"the model {self.model.name}, which takes {buffer.name} alone",
                    allowed="a model that takes phones",
                )
            self._expected.add(phones, self._samples / self.sample_rate)

    def interrupt(self, frame: int) -> None:
        """Silence from a frame on, in place of the sound that was pushed; it is given again."""
        with self._lock:
            self._frames = frame
            self._expected = ExpectedPhones()
            self._hear_from(math.floor(self._frames / self.fps * PIECES_PER_S) / PIECES_PER_S)
            silent = self._samples - round(self._origin_s * self.sample_rate)
            for buffer in self._buffers:
                buffer.push(np.zeros(max(0, silent), np.float32))

    def flush(self) -> Curves | None:
        """End the sound, and give the remaining frames.

        None where there are none, or the sound was too short to be any.
        """
        with self._lock:
            if self._ended or not self._samples:
                self._ended = True
                return None
            self._ended = True
            for buffer in self._buffers:
                buffer.flush()
            if any(buffer.known_s < 0 for buffer in self._buffers):
                return None  # a sample or two is too short to encode
            total = frames_in(self._samples / self.sample_rate, self.fps)
            return self._answer(total - self._frames) if total > self._frames else None

    @property
    def _buffers(self) -> list[_FeatureBuffer]:
        return [self._features] if self._phones is None else [self._features, self._phones]

    def _answer(self, count: int) -> Curves:
        span = FrameSpan(self._frames, count, self.fps)
        phones = None if self._phones is None else self._phones.features
        if phones is not None and self._coming_phones is not None and not self._ended:
            known = np.concatenate([phones.values, self._coming_phones()])
            phones = replace(phones, values=known)
        features, last_s = self._features.features, (span.first + count - 1) / self.fps
        may_come = self.is_live and not self._ended
        if phones is not None:
            phones, known = self._expected.laid_over(phones, last_s, may_come=may_come)
        else:
            features, known = self._expected.laid_over(features, last_s, may_come=may_come)
        speech = SpeechFeatures(
            features, phones, known=known, live=self.is_live, origin_s=self._origin_s
        )
        curves = self.model.curves(
            speech, self._style, span, self._strength, contacts=self._contacts
        )
        self._frames += count
        for buffer in self._buffers:
            buffer.forget_before(self._frames / self.fps - HISTORY_S)
        return curves


class _FeatureBuffer:
    """The rows of a feature stream that are still needed; the first stands at `origin_s`."""

    def __init__(self, stream: FeatureStream, origin_s: float) -> None:
        self._stream = stream
        self._values: Float32Array | None = None
        self._first = round(origin_s * stream.rate)

    @property
    def name(self) -> str:
        """Of the features."""
        return self._stream.name

    @property
    def features(self) -> Features:
        """The rows that are kept."""
        assert self._values is not None
        return Features(self._values, self._stream.rate, self._stream.name, self._first)

    @property
    def known_s(self) -> float:
        """The time of the last row."""
        count = 0 if self._values is None else len(self._values)
        return (self._first + count - 1) / self._stream.rate

    def push(self, block: Float32Array) -> None:
        self._add(self._stream.push(block))

    def flush(self) -> None:
        self._add(self._stream.flush())

    def _add(self, rows: Float32Array) -> None:
        self._values = rows if self._values is None else np.concatenate([self._values, rows])

    def forget_before(self, time_s: float) -> None:
        drop = math.floor(time_s * self._stream.rate) - self._first
        if self._values is not None and drop > 0:
            drop = min(drop, len(self._values) - 1)
            self._values, self._first = self._values[drop:], self._first + drop


def _least_lookahead(model: SpeechModel, sample_rate: int) -> float:
    """The shortest look-ahead that frames can have, s."""
    return model.live_lookahead_s + resampling_s(sample_rate, SPEECH_RATE, prompt=True)


def _live_lookahead(model: SpeechModel, sample_rate: int, lookahead: float | str) -> float | None:
    """A look-ahead in s, None where frames are exact. Raises InputError."""
    if lookahead == EXACT:
        return None
    seconds, least = real_number(lookahead), _least_lookahead(model, sample_rate)
    if seconds is None or not least <= seconds <= LOOKAHEAD_MAX_S:
        allowed = f"exact ({model.name})"
        if math.isfinite(least):
            allowed = f"exact, or {math.ceil(100 * least) / 100:g} to {LOOKAHEAD_MAX_S:g} s"
        raise InputError.about("`lookahead`", found=brief(lookahead), allowed=allowed)
    return seconds


def _check_level(level: SoundLevel | None) -> None:
    """Raise InputError for anything but a mean and a peak; of silence the peak is infinite."""
    if level is None:
        return
    parts = level if isinstance(level, tuple | list) and len(level) == 2 else (None, None)
    mean, peak = real_number(parts[0]), parts[1]
    loudest = math.inf if peak == math.inf else real_number(peak)
    if mean is None or loudest is None or loudest <= 0:
        raise InputError.about(
            "level", found=brief(level), allowed="(mean, peak) of the sound, the peak above 0"
        )


def checked_block(samples: NDArray[np.generic], sample_rate: int, offset: int) -> Float32Array:
    """(sample,) float32 within the range of sound. Raises AudioError."""
    array = array_of(samples, "block", error=AudioError, allowed="samples")
    if array.size > NUMBERS_MAX:
        raise AudioError.about(
            "block", found=f"{array.size} samples", allowed=f"up to {NUMBERS_MAX} in one block"
        )
    many = array.ndim == 2 and 0 < array.shape[1] <= CHANNELS_MAX
    if not (array.ndim == 1 or many) or (array.dtype.kind != "f" and array.dtype != np.int16):
        raise AudioError.about(
            "block",
            found=f"{array.dtype} of shape {array.shape}",
            allowed="(sample,) or (sample, channel) of floats within ±1 or 16-bit integers",
        )
    scale = np.float32(INT16) if array.dtype == np.int16 else np.float32(1)
    with np.errstate(over="ignore"):
        block = array.astype(np.float32) * scale
        block = block.mean(axis=1) if many else block
    check_samples("block", block, sample_rate, offset)
    return block
