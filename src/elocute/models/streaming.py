"""Live animation: blocks of sound in, frames of a face out."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.articulation.settings import AnimationSettings
from elocute.audio.pcm import CHANNELS_MAX, PcmBytes
from elocute.errors import InputError
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import identity_choice, resolve_identity
from elocute.life.director import CHANNELS
from elocute.life.face import LivingFace, rows_of_frames
from elocute.life.moods import Mood, resolve_mood
from elocute.life.people import person_of
from elocute.life.prosody import ROW_RATE
from elocute.life.settings import resolve_life
from elocute.life.stream import LifeStream
from elocute.models.curve_stream import EXACT, CurveStream, checked_block
from elocute.models.protocol import (
    SoundLevel,
)
from elocute.models.registry import DEFAULT_MODEL, open_model
from elocute.models.take_settings import StreamOptions, StreamSettings
from elocute.motion.curves import Curves
from elocute.numerics.frame_rates import frame_rate
from elocute.numerics.input_checks import (
    check_kind,
    real_number,
    whole_number,
)
from elocute.numerics.quaternions import blend, no_turn
from elocute.numerics.smoothing import smoothstep
from elocute.one_line_repr import brief
from elocute.settings import setting_of, taking
from elocute.speech.times.labels import Label

INTERRUPTED_S = 0.12  # in which a mouth comes to rest that is interrupted
IDLE_MAX_S = 600.0
BEGIN_S = 0.3  # in which life begins where a face is shown before its first row is known
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


class Stream:
    """Live animation, as `elocute.stream` opens it: blocks of sound in, `Frame`s out.

    Several threads may push; a block is taken whole before the next one.

    Parameters
    ----------
    curves : CurveStream
        The mouth.
    face : LivingFace, optional
        What is laid over it, on the built-in head.
    channels : int
        Of sound that is pushed as bytes.
    """

    def __init__(self, curves: CurveStream, face: LivingFace | None, channels: int = 1) -> None:
        self._curves, self._face = curves, face
        self._channels, self._pcm = channels, PcmBytes(channels)
        self._shown: Frame | None = None
        self._left_from: tuple[Frame, int] | None = None  # a frame, and when it was interrupted
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
        self, samples: NDArray[np.floating] | NDArray[np.int16] | bytes, *, listen: bool = False
    ) -> Iterator[Frame]:
        """Take a block of sound; it counts as pushed at once.

        Parameters
        ----------
        samples : (sample,) or (sample, channel) floats within ±1, or int16, or bytes
            At the stream's rate, of any length; channels are averaged. Bytes are samples of 16
            bits, little-endian, and may end within one.
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
            if isinstance(samples, bytes | bytearray | memoryview):
                samples = self._pcm.push(bytes(samples))
            block = checked_block(samples, self._curves.sample_rate, self._curves.samples_taken)
            self._take(self._curves.push(np.zeros_like(block) if listen else block))
            if self._life is None:
                return self._frames(self._curves.frames_given)
            self._rows = np.concatenate([self._rows, self._life.push(block, listen)])
            lively = (self._first_row + len(self._rows) - 1) * self._curves.fps / self._life.rate
            return self._frames(min(self._curves.frames_given, math.floor(lively) + self._late))

    def expect(self, phones: Sequence[Label]) -> None:
        """Take phones that a speech engine tells of the sound that is pushed next.

        Lips then meet on every p, b, m, f and v, and begin to in time.

        Parameters
        ----------
        phones : list of (float, float, str)
            Start and end in s after the last sample that was pushed, and ARPAbet phone.

        Raises
        ------
        InputError
            For an unknown phone, times that run backwards or beyond ten minutes, and a model that
            takes no phones.
        """
        self._curves.expect(phones)

    def idle(self, seconds: float) -> Iterator[Frame]:
        """Silence of some seconds, for a face that waits; frames are as `push` gives them."""
        length_s = real_number(seconds)
        if length_s is None or not 0 <= length_s <= IDLE_MAX_S:
            raise InputError.about(
                "`seconds`", found=brief(seconds), allowed=f"0 to {IDLE_MAX_S:g} s at a time"
            )
        return self.push(np.zeros(round(length_s * self.sample_rate), np.float32))

    def interrupt(self, shown: Frame | None = None) -> None:
        """Drop what was pushed and not given yet, as when somebody is interrupted.

        Time goes on: the next frames come to rest from the frame that is shown now, the last one
        given by default, within 0.12 s. What lives beside the mouth goes on.
        """
        check_kind("shown", shown, Frame | None, "a frame of this stream")
        with self._lock:
            self._curves.interrupt(self._given)
            self._waiting.clear()
            self._pcm = PcmBytes(self._channels)
            left = shown or self._shown
            self._left_from = None if left is None else (left, self._given)

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
        frames = [
            self._from_left(Frame((first + place) / fps, curves.names, row, turns), first + place)
            for place, (row, turns) in enumerate(zip(curves.values, rotations, strict=True))
        ]
        self._shown = frames[-1]
        return iter(frames)

    def _from_left(self, frame: Frame, number: int) -> Frame:
        """On the way from a frame that was interrupted."""
        if self._left_from is None:
            return frame
        left, begin = self._left_from
        share = (number + 1 - begin) / self._curves.fps / INTERRUPTED_S
        if share >= 1 or left.names != frame.names:
            self._left_from = None
            return frame
        share = smoothstep(np.array(share, np.float32))
        turns = blend(left.rotations, frame.rotations, share).astype(np.float32)
        values = left.values + share * (frame.values - left.values)
        return replace(frame, values=values, rotations=turns)

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
    channels: int = 1,
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
        How much later than its time a frame comes, s: for "talkers" 0.21 and more; its frames are
        then made from what is known so far. "exact" waits for all that bears on a frame, 1.5 s, and
        gives what `animate` gives.
    channels : int
        Of sound that is pushed as bytes, 1 to 64; arrays tell theirs.

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
    count = whole_number(channels)
    if count is None or not 0 < count <= CHANNELS_MAX:
        raise InputError.about("`channels`", found=brief(channels), allowed=f"1 to {CHANNELS_MAX}")
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
        return Stream(curves, None, count)
    return Stream(curves, LivingFace(load_builtin_head(), alive, feeling, person), count)


def strength_in_mood(strength: float, mood: Mood) -> float:
    """How far the mouth moves in a mood, within what is allowed."""
    return min(strength * mood.mouth, setting_of(AnimationSettings, "strength").high or math.inf)
