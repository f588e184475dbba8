"""Live speech: blocks of sound in, frames of curves out, each as soon as it is certain.

What has been heard is kept for `HISTORY_S` behind the frames given out, so that memory stays
bounded; a frame is answered from that stretch exactly as it would be from the whole sound.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.articulation.driver import HISTORY_S
from elocute.articulation.style import Style
from elocute.audio.features import Features
from elocute.audio.waveform import check_rate, check_samples
from elocute.errors import AudioError, InputError
from elocute.models.protocol import Ear, Heard, Level, Span, SpeechModel
from elocute.models.registry import DEFAULT, open_model
from elocute.models.styles import checked_style
from elocute.motion.curves import Curves
from elocute.numerics.given import NUMBERS_MAX, array_of, real_number
from elocute.numerics.resampling import frames_in
from elocute.one_line_repr import brief

Array = NDArray[np.float32]
FPS_RANGE = (1.0, 240.0)
STRENGTH_RANGE = (0.0, 2.0)
BEYOND_S = 1.0  # frames that a live take has at least after the last one given out
INT16_SCALE = 1 / 32768


@dataclass(frozen=True, eq=False)
class Frame:
    """One moment of a face.

    time_s     since the first sample
    names      of the curves
    values     (curve,) float32
    rotations  (joint, 4) wxyz of the head's joints; at rest, as speech turns none of them yet
    """

    time_s: float
    names: tuple[str, ...]
    values: Array
    rotations: Array

    def __getitem__(self, name: str) -> float:
        """The value of one curve. Raises KeyError for a name that there is not."""
        try:
            return float(self.values[self.names.index(name)])
        except ValueError:
            raise KeyError(name) from None

    def __repr__(self) -> str:
        moved = int(np.count_nonzero(self.values))
        return f"Frame({self.time_s:.4f} s, {moved} of {len(self.names)} curves moved)"


class CurveStream:
    """A model's answer to sound in blocks: `push` gives the frames that are certain.

    With `level` (mean and peak of the whole sound) a model that normalises by it gives what the
    whole sound gives; without, it goes by what it has heard so far. Raises InputError for
    settings out of range, and what the model raises for a style.
    """

    def __init__(
        self,
        model: SpeechModel,
        sample_rate: int,
        *,
        fps: float = 60.0,
        style: str | Style = "plain",
        strength: float = 1.0,
        level: Level | None = None,
    ) -> None:
        check_range("fps", fps, FPS_RANGE)
        check_range("strength", strength, STRENGTH_RANGE)
        self.model, self.fps = model, float(fps)
        self.sample_rate = check_rate("stream", sample_rate)
        self._style, self._strength = model.style(checked_style(style)), strength
        _check_level(level)
        ears = model.ears(self.sample_rate, level=level)
        self._features = _Rows(ears.features)
        self._phones = None if ears.phones is None else _Rows(ears.phones)
        self._samples = self._frames = 0
        self._ended = False

    @property
    def lookahead_s(self) -> float:
        """A frame comes out when so much sound after its own time has been pushed."""
        return self.model.lookahead_s

    @property
    def frames_given(self) -> int:
        """How many frames `push` and `flush` gave so far; the next one's time is that / fps."""
        return self._frames

    def push(self, samples: NDArray[np.floating] | NDArray[np.int16]) -> Curves | None:
        """Curves of the frames that are certain now, or None.

        samples (sample,) floats within ±1 or 16-bit integers, of any length. Raises AudioError
        for anything else, and after `flush`.
        """
        if self._ended:
            raise AudioError("stream: found sound after its end; allowed: a new stream")
        block = checked_block(samples, self.sample_rate, self._samples)
        self._samples += len(block)
        for rows in self._tracks:
            rows.push(block)
        certain_s = min(rows.known_s for rows in self._tracks) - self.model.answer_lookahead_s
        count = math.floor(certain_s * self.fps) + 1 - self._frames
        return self._answer(count, None) if count > 0 else None

    def flush(self) -> Curves | None:
        """The rest, once no more sound comes. Nothing is answered to silence of no length."""
        if self._ended or not self._samples:
            self._ended = True
            return None
        self._ended = True
        for rows in self._tracks:
            rows.flush()
        if any(rows.known_s < 0 for rows in self._tracks):
            return None  # a sample or two is no sound
        total = frames_in(self._samples / self.sample_rate, self.fps)
        return self._answer(total - self._frames, total) if total > self._frames else None

    @property
    def _tracks(self) -> list[_Rows]:
        return [self._features] if self._phones is None else [self._features, self._phones]

    def _answer(self, count: int, total: int | None) -> Curves:
        if total is None:
            total = self._frames + count + math.ceil(BEYOND_S * self.fps)
        span = Span(self._frames, count, self.fps, total)
        phones = None if self._phones is None else self._phones.features
        heard = Heard(self._features.features, phones)
        curves = self.model.curves(heard, self._style, span, self._strength)
        self._frames += count
        for rows in self._tracks:
            rows.forget_before(self._frames / self.fps - HISTORY_S)
        return curves


class _Rows:
    """Rows that an ear gave and that are still needed."""

    def __init__(self, ear: Ear) -> None:
        self._ear = ear
        self._values: Array | None = None
        self._first = 0

    @property
    def features(self) -> Features:
        """What is kept."""
        assert self._values is not None
        return Features(self._values, self._ear.rate, self._ear.name, self._first)

    @property
    def known_s(self) -> float:
        """The time of the last row."""
        count = 0 if self._values is None else len(self._values)
        return (self._first + count - 1) / self._ear.rate

    def push(self, block: Array) -> None:
        self._add(self._ear.push(block))

    def flush(self) -> None:
        self._add(self._ear.flush())

    def _add(self, rows: Array) -> None:
        self._values = rows if self._values is None else np.concatenate([self._values, rows])

    def forget_before(self, time_s: float) -> None:
        drop = math.floor(time_s * self._ear.rate) - self._first
        if self._values is not None and drop > 0:
            drop = min(drop, len(self._values) - 1)
            self._values, self._first = self._values[drop:], self._first + drop


class Stream:
    """What `elocute.stream` gives: sound in, `Frame`s out."""

    def __init__(self, curves: CurveStream, names: tuple[str, ...], joints: int) -> None:
        self._curves, self._names = curves, names
        self._rest = np.tile(np.array([1, 0, 0, 0], np.float32), (joints, 1))

    @property
    def lookahead_s(self) -> float:
        """A frame comes out when so much sound after its own time has been pushed."""
        return self._curves.lookahead_s

    def push(self, samples: NDArray[np.floating] | NDArray[np.int16]) -> Iterator[Frame]:
        """The frames that are certain now. The block counts as pushed at once.

        samples (sample,) mono floats within ±1 or 16-bit integers at the stream's rate. Raises
        AudioError for anything else.
        """
        first = self._curves.frames_given
        return self._frames(self._curves.push(samples), first)

    def flush(self) -> Iterator[Frame]:
        """The frames that are left, once no more sound comes."""
        first = self._curves.frames_given
        return self._frames(self._curves.flush(), first)

    def _frames(self, curves: Curves | None, first: int) -> Iterator[Frame]:
        if curves is None:
            return iter(())
        names = self._names or curves.names
        rows = curves.select(names).values
        return iter(
            [
                Frame((first + place) / self._curves.fps, names, row, self._rest)
                for place, row in enumerate(rows)
            ]
        )

    def __repr__(self) -> str:
        given = self._curves.frames_given
        return f"Stream({self._curves.model.name}, {self._curves.fps:g} fps, {given} frames given)"


def stream(
    rate: int = 48000,
    model: str | Path = DEFAULT,
    fps: float = 60.0,
    *,
    style: str | Style = "plain",
    strength: float = 1.0,
    level: Level | None = None,
) -> Stream:
    """Animate speech while it comes in.

        live = elocute.stream(rate=48000, model="articulation", fps=60)
        for block in microphone:
            for frame in live.push(block):
                frame.time_s, frame["jawOpen"]
        for frame in live.flush():
            ...

    rate      of the sound, Hz
    model     "articulation", "voca", "crnn", or a trained model (.onnx)
    fps       frames per second, 1…240
    style     a name, a mix, or a .json file, as `animate` takes it
    strength  how far the mouth moves, 0…2
    level     mean and peak of the whole sound, where known (the recurrent model hears by them)

    A frame knows all curves of the built-in head, or of the model's own shapes. It comes out
    `lookahead_s` after its time. Raises InputError (AudioError, ModelError).
    """
    from elocute.head.builtin import load_builtin_head

    opened, head = open_model(model), load_builtin_head()
    curves = CurveStream(opened, rate, fps=fps, style=style, strength=strength, level=level)
    names = head.expression_names if opened.makes_contacts else ()
    return Stream(curves, names, len(head.joint_names) if opened.makes_contacts else 0)


def _check_level(level: Level | None) -> None:
    """Raise InputError where it is no mean and peak; of silence the peak is infinite."""
    if level is None:
        return
    parts = level if isinstance(level, tuple | list) and len(level) == 2 else (None, None)
    mean, peak = real_number(parts[0]), parts[1]
    loudest = math.inf if peak == math.inf else real_number(peak)
    if mean is None or loudest is None or loudest <= 0:
        raise InputError.about(
            "level", found=brief(level), allowed="(mean, peak) of the sound, the peak above 0"
        )


def check_range(name: str, value: float, allowed: tuple[float, float]) -> None:
    """Raise InputError for a setting outside its range."""
    low, high = allowed
    number = real_number(value)
    if number is None or not low <= number <= high:
        raise InputError.about(name, found=brief(value), allowed=f"{low:g} to {high:g}")


def checked_block(samples: NDArray[np.generic], sample_rate: int, offset: int) -> Array:
    """(sample,) float32 within the range of sound. Raises AudioError."""
    given = array_of(samples, "block", error=AudioError, allowed="samples")
    if given.size > NUMBERS_MAX:
        raise AudioError.about(
            "block", found=f"{given.size} samples", allowed=f"up to {NUMBERS_MAX} in one block"
        )
    if given.ndim != 1 or (given.dtype.kind != "f" and given.dtype != np.int16):
        raise AudioError.about(
            "block",
            found=f"{given.dtype} of shape {given.shape}",
            allowed="(sample,) of floats within ±1 or 16-bit integers",
        )
    scale = np.float32(INT16_SCALE) if given.dtype == np.int16 else np.float32(1)
    with np.errstate(over="ignore"):
        block = given.astype(np.float32) * scale
    check_samples("block", block, sample_rate, offset)
    return block
