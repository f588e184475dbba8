"""Live speech: blocks of sound in, frames of curves out, each as soon as it is certain.

Features are kept for `HISTORY_S` behind the last frame, so that memory stays bounded; a frame is
computed from that stretch exactly as it would be from the whole sound. With a `lookahead` frames do
not wait for all that bears on them: each is made from what is known so far, and is not taken back.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.articulation.driver import HISTORY_S
from elocute.articulation.settings import AnimationSettings, lays_contacts, mixes_outputs
from elocute.articulation.style import Style
from elocute.audio.features import Features
from elocute.audio.resampling_stream import resampling_s
from elocute.audio.waveform import SPEECH_RATE, check_rate, check_samples
from elocute.errors import AudioError, InputError
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import identity_choice, resolve_identity
from elocute.life.director import CHANNELS
from elocute.life.face import LivingFace, rows_of_frames
from elocute.life.moods import Mood, resolve_mood
from elocute.life.people import person_of
from elocute.life.prosody import ROW_RATE
from elocute.life.settings import resolve_life
from elocute.life.stream import LifeStream
from elocute.models.protocol import (
    FeatureStream,
    FrameSpan,
    SoundLevel,
    SpeechFeatures,
    SpeechModel,
)
from elocute.models.registry import DEFAULT_MODEL, open_model
from elocute.models.style_mixes import checked_style
from elocute.models.take_settings import StreamOptions, StreamSettings
from elocute.motion.curves import Curves
from elocute.numerics.frame_rates import frame_rate
from elocute.numerics.input_checks import (
    NUMBERS_MAX,
    array_of,
    check_kind,
    real_number,
)
from elocute.numerics.quaternions import no_turn
from elocute.numerics.resampling import frames_in
from elocute.numerics.smoothing import smoothstep
from elocute.one_line_repr import brief
from elocute.settings import setting_of, taking

INT16_SCALE = 1 / 32768
EXACT = "exact"
LOOKAHEAD_MAX_S = 10.0  # nobody waits longer for an answer
BEGIN_S = 0.3  # in which life begins where a face is shown before its first row is known
PIECES_PER_S = 50  # as many as rows of the trunk
STILL = np.zeros((1, len(CHANNELS)), np.float32)
"""A row of life before any was heard."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame of a face.

    Parameters
    ----------
    time_s : float
        Seconds since the first sample.
    names : tuple of str
        The names of the curves.
    values : (curve,) float32
        Their values: 0 to 1 on the built-in head.
    rotations : (joint, 4) float32
        Quaternions wxyz of the head's joints.
    """

    time_s: float
    names: tuple[str, ...]
    values: Float32Array
    rotations: Float32Array

    def __getitem__(self, name: str) -> float:
        """The value of one curve. Raises KeyError for an unknown name."""
        try:
            return float(self.values[self.names.index(name)])
        except ValueError:
            raise KeyError(name) from None

    def __repr__(self) -> str:
        moved = int(np.count_nonzero(self.values))
        return f"Frame({self.time_s:.4f} s, {moved} of {len(self.names)} curves moved)"


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
        streams = model.feature_streams(
            self.sample_rate, contacts=self._contacts, level=level, live=self.is_live
        )
        self._coming_phones = streams.coming_phones
        self._features = _FeatureBuffer(streams.features)
        self._phones = None if streams.phones is None else _FeatureBuffer(streams.phones)
        self._samples = self._frames = 0
        self._ended = False
        self._lock = threading.RLock()

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
        waiting_s = self.model.decoder_lookahead_s
        if self._lookahead_s is not None:
            waiting_s = self._lookahead_s - _least_lookahead(self.model, self.sample_rate)
        certain_s = min(buffer.known_s for buffer in self._buffers) - waiting_s
        count = math.floor(certain_s * self.fps) + 1 - self._frames
        return self._answer(count) if count > 0 else None

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
        speech = SpeechFeatures(self._features.features, phones, live=self.is_live)
        curves = self.model.curves(
            speech, self._style, span, self._strength, contacts=self._contacts
        )
        self._frames += count
        for buffer in self._buffers:
            buffer.forget_before(self._frames / self.fps - HISTORY_S)
        return curves


class _FeatureBuffer:
    """The rows of a feature stream that are still needed."""

    def __init__(self, stream: FeatureStream) -> None:
        self._stream = stream
        self._values: Float32Array | None = None
        self._first = 0

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


class Stream:
    """Live animation, as `elocute.stream` opens it: blocks of sound in, `Frame`s out.

    Several threads may push; a block is taken whole before the next one.

    Parameters
    ----------
    curves : CurveStream
        The mouth.
    face : LivingFace, optional
        What is laid over it, on the built-in head.
    """

    def __init__(self, curves: CurveStream, face: LivingFace | None) -> None:
        self._curves, self._face = curves, face
        self._given, self._ended = 0, False
        self._lock = threading.RLock()
        self._waiting: list[Curves] = []
        self._life: LifeStream | None = None
        self._rows, self._first_row = STILL, 0
        self._late = 0  # frames by which life follows a mouth that does not wait for it
        if face is not None and face.listens:
            self._life, self._rows = face.stream(curves.sample_rate), self._rows[:0]
            if curves.is_live:
                waited_s = self._life.lookahead_s - curves.lookahead_s
                self._late = max(0, math.ceil(waited_s * curves.fps))

    @property
    def sample_rate(self) -> int:
        """Of the sound, Hz."""
        return self._curves.sample_rate

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self._curves.fps

    @property
    def lookahead_s(self) -> float:
        """How much sound after its own time a frame waits for, s."""
        mouth_s = self._curves.lookahead_s
        return mouth_s if self._life is None or self._late else max(mouth_s, self._life.lookahead_s)

    def push(
        self, samples: NDArray[np.floating] | NDArray[np.int16], *, listen: bool = False
    ) -> Iterator[Frame]:
        """Take a block of sound; it counts as pushed at once.

        Parameters
        ----------
        samples : (sample,) floats within ±1, or int16
            Mono, at the stream's rate, of any length.
        listen : bool
            Whether it is a partner's voice: the face listens, and its lips rest. Each block may be
            either, as people take turns.

        Returns
        -------
        iterator of Frame
            The frames that are certain now, perhaps none.

        Raises
        ------
        AudioError
            For anything else, and after `flush`.
        """
        check_kind("listen", listen, bool, "True or False")
        with self._lock:
            block = checked_block(samples, self._curves.sample_rate, self._curves.samples_taken)
            self._take(self._curves.push(np.zeros_like(block) if listen else block))
            if self._life is None:
                return self._frames(self._curves.frames_given)
            self._rows = np.concatenate([self._rows, self._life.push(block, listen)])
            lively = (self._first_row + len(self._rows) - 1) * self._curves.fps / self._life.rate
            return self._frames(min(self._curves.frames_given, math.floor(lively) + self._late))

    def flush(self) -> Iterator[Frame]:
        """End the sound.

        Returns
        -------
        iterator of Frame
            The remaining frames.
        """
        with self._lock:
            self._take(self._curves.flush())
            if self._life is not None and not self._ended:
                self._rows = np.concatenate([self._rows, self._life.flush()])
            self._ended = True
            return self._frames(self._curves.frames_given)

    def _take(self, curves: Curves | None) -> None:
        if curves is not None:
            self._waiting.append(curves)

    def _frames(self, until: int) -> Iterator[Frame]:
        """The frames up to `until` that were not given yet."""
        first, count = self._given, until - self._given
        if count <= 0:
            return iter(())
        fps, names = self._curves.fps, self._waiting[0].names
        values = np.concatenate([each.values for each in self._waiting])
        self._waiting = [Curves(values[count:], names, fps)]
        self._given = until
        curves, rotations = Curves(values[:count], names, fps), no_turn(count, 0)
        if self._face is not None:
            heard = self._rows if len(self._rows) else STILL
            rows = rows_of_frames(heard, self._first_row, first - self._late, count, fps)
            if self._late:  # before anything is known of it, life begins slowly
                known_s = (np.arange(first, first + count) - self._late) / fps
                share = smoothstep(np.clip(known_s / BEGIN_S, 0, 1))
                rows = (rows * share[:, None]).astype(np.float32)
            head = self._face.head
            curves = self._face.curves(curves, rows).select(head.expression_names)
            turned = self._face.rotations(rows)
            rotations = no_turn(count, len(head.joint_names)) if turned is None else turned
            self._forget_before(math.floor((until - self._late) * ROW_RATE / fps))
        return iter(
            [
                Frame((first + place) / fps, curves.names, row, turns)
                for place, (row, turns) in enumerate(zip(curves.values, rotations, strict=True))
            ]
        )

    def _forget_before(self, row: int) -> None:
        drop = min(row - self._first_row, len(self._rows) - 1)
        if drop > 0 and self._life is not None:
            self._rows, self._first_row = self._rows[drop:], self._first_row + drop

    def __repr__(self) -> str:
        count = self._curves.frames_given
        return f"Stream({self._curves.model.name}, {self._curves.fps:g} fps, {count} frames given)"


@taking(StreamSettings)
def stream(
    rate: int = 48000,
    model: str | Path = DEFAULT_MODEL,
    fps: float = 60.0,
    *,
    level: SoundLevel | None = None,
    lookahead: float | str = EXACT,
    **settings: Unpack[StreamOptions],
) -> Stream:
    """Animate speech while it comes in.

    A frame has all curves of the built-in head, or of the model's own shapes. It comes out
    `lookahead_s` after its time. Curves fit any face; the identity says who lives in it.

    Parameters
    ----------
    rate : int
        Sample rate of the sound, Hz.
    model : str or Path
        A name of `elocute.models.model_names`, or a trained model (.onnx).
    fps : float
        Frames per second, 1 to 240; 29.97 is taken for 30000/1001.
    level : (float, float), optional
        Mean and peak of the whole sound, where known: the recurrent model normalises by them.
    lookahead : float or str
        How much later than its time a frame comes, s: for "talkers" 0.28 and more, of sound at 16
        kHz 0.25; its frames are then made from what is known so far. "exact" waits for all that
        bears on a frame, 1.5 s, and gives what `animate` gives.

    Returns
    -------
    Stream
        Takes sound by `push` and `flush`.

    Raises
    ------
    InputError
        For settings out of range; AudioError for the rate, ModelError for model and style,
        HeadError for the identity.

    Examples
    --------
    ::

        live = elocute.stream(rate=48000, fps=60)
        for block in microphone:
            for frame in live.push(block):
                frame.time_s, frame["jawOpen"]
        for frame in live.flush():
            ...
    """

    take = StreamSettings(model=model, fps=fps, **settings)
    alive, feeling = resolve_life(take.life), resolve_mood(take.mood)
    opened = open_model(take.model)
    curves = CurveStream(
        opened,
        rate,
        fps=frame_rate(take.fps),
        style=take.style,
        strength=strength_in_mood(take.strength, feeling),
        level=level,
        contacts=take.contacts,
        mix=take.mix,
        lookahead=lookahead,
    )
    person = person_of(resolve_identity(identity_choice(take.identity))).drawn(take.seed)
    if not opened.makes_contacts:
        return Stream(curves, None)
    return Stream(curves, LivingFace(load_builtin_head(), alive, feeling, person))


def _least_lookahead(model: SpeechModel, sample_rate: int) -> float:
    """The shortest look-ahead that frames can have, s."""
    return model.live_lookahead_s + resampling_s(sample_rate, SPEECH_RATE)


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


def strength_in_mood(strength: float, mood: Mood) -> float:
    """How far the mouth moves in a mood, within what is allowed."""
    return min(strength * mood.mouth, setting_of(AnimationSettings, "strength").high or math.inf)


def checked_block(samples: NDArray[np.generic], sample_rate: int, offset: int) -> Float32Array:
    """(sample,) float32 within the range of sound. Raises AudioError."""
    array = array_of(samples, "block", error=AudioError, allowed="samples")
    if array.size > NUMBERS_MAX:
        raise AudioError.about(
            "block", found=f"{array.size} samples", allowed=f"up to {NUMBERS_MAX} in one block"
        )
    if array.ndim != 1 or (array.dtype.kind != "f" and array.dtype != np.int16):
        raise AudioError.about(
            "block",
            found=f"{array.dtype} of shape {array.shape}",
            allowed="(sample,) of floats within ±1 or 16-bit integers",
        )
    scale = np.float32(INT16_SCALE) if array.dtype == np.int16 else np.float32(1)
    with np.errstate(over="ignore"):
        block = array.astype(np.float32) * scale
    check_samples("block", block, sample_rate, offset)
    return block
