"""A face at the pace of a clock, and the speech of an agent that is held back for it.

An agent's voice comes in bursts, faster than it is heard. A face needs some of it in advance, and
moves also while nobody speaks. So sound goes into one stream at an even pace, silence where there
is no speech, and a piece of speech is let go when the frame at its first sample comes out.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, TypeVar, Unpack

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.pcm import INT16
from elocute.audio.resampling_stream import ResamplingStream
from elocute.audio.waveform import SPEECH_RATE, check_rate
from elocute.errors import AudioError, InputError
from elocute.live.json_lines import frame_record
from elocute.live.live_frame import SHAPES, LiveFrame
from elocute.models.streaming import stream
from elocute.models.take_settings import StreamOptions
from elocute.one_line_repr import brief

MESSAGE = "elocute-face"
"""What the messages of a face are called, so that a page tells them from others."""
BLOCK_S = 0.02
SLACK_S = 0.1
"""Speech may come as much too late without a gap, since as much of it is let go in advance."""
STALL_S = 0.2
"""A clock that ran on by more, on a busy machine, delays what follows."""

Item = TypeVar("Item")


@dataclass(frozen=True)
class Moment(Generic[Item]):
    """The message of a frame, or None, and what accompanied the speech that is heard with it."""

    message: dict[str, Any] | None
    items: list[Item]


@dataclass(frozen=True)
class _Held(Generic[Item]):
    """What accompanies speech, the sample at which that begins, and whether it goes on there."""

    at: int
    goes_on: bool
    item: Item


class _Ear:
    """A voice in pieces of any rate, as the stream takes it."""

    def __init__(self) -> None:
        self._rate, self._resampler = SPEECH_RATE, ResamplingStream(SPEECH_RATE, SPEECH_RATE)

    def samples(self, pcm: bytes, rate: int, channels: int) -> Float32Array:
        """(sample,) at `SPEECH_RATE` of 16 bits in this machine's order. Raises AudioError."""
        if channels < 1:
            raise AudioError.about("speech", found=f"{channels} channels", allowed="1 or more")
        check_rate("speech", rate)
        whole = len(pcm) // (2 * channels) * 2 * channels
        mono = np.frombuffer(pcm[:whole], np.int16).reshape(-1, channels).mean(axis=1)
        if rate != self._rate:
            self._rate = rate
            self._resampler = ResamplingStream(rate, SPEECH_RATE, prompt=True)
        return self._resampler.push((mono * INT16).astype(np.float32))


class PacedFace(Generic[Item]):
    """One face for a whole conversation: `say` speech as it comes, ask `moments` what is due.

    All but `moments` return at once. Curves are of `SHAPES`. Other settings are those of
    `elocute.stream`; the look-ahead is how long speech is held back.

    Raises
    ------
    InputError
        For settings out of range; ModelError, HeadError for those that are not there.
    """

    def __init__(
        self,
        *,
        fps: float = 30.0,
        lookahead: float = 0.25,
        shapes: str = "arkit",
        clock: Callable[[], float] = time.monotonic,
        **settings: Unpack[StreamOptions],
    ) -> None:
        if shapes not in SHAPES:
            raise InputError.about("`shapes`", found=brief(shapes), allowed=", ".join(SHAPES))
        self._values = SHAPES[shapes].values
        self._stream = stream(SPEECH_RATE, fps=fps, lookahead=lookahead, **settings)
        self._clock = clock
        self._began_s: float | None = None
        self._waiting: deque[tuple[Float32Array, Item | None]] = deque()
        self._held: deque[_Held[Item]] = deque()
        self._voice, self._partner = _Ear(), _Ear()
        self._heard = np.zeros(0, np.float32)  # of the partner, and not given to the stream yet
        self._pushed = self._frames = 0
        self._shown = self._spoken = -1  # the last frame's sample, and the one behind all speech
        self._speaks = False

    @property
    def lookahead_s(self) -> float:
        """How long speech is held back, s."""
        return self._stream.lookahead_s

    @property
    def is_idle(self) -> bool:
        """Whether all speech was let go."""
        return not (self._waiting or self._held)

    def say(self, pcm: bytes, rate: int, channels: int, item: Item) -> None:
        """Take speech as samples of 16 bits; the item comes back with it.

        Raises AudioError for a rate or a number of channels that no sound has.
        """
        self._waiting.append((self._voice.samples(pcm, rate, channels), item))
        self._speaks = True

    def hear(self, pcm: bytes, rate: int, channels: int) -> None:
        """Take the voice of a partner, to whom the face listens while it does not speak.

        Raises AudioError as `say` does.
        """
        heard = np.concatenate([self._heard, self._partner.samples(pcm, rate, channels)])
        self._heard = heard[-round(STALL_S * SPEECH_RATE) :]

    def follow(self, item: Item) -> None:
        """Take what comes back in its turn, once the speech before it was let go."""
        self._waiting.append((np.zeros(0, np.float32), item))

    def end(self) -> None:
        """All that is said now was taken: a pause behind it waits for nothing."""
        self._speaks = False

    def interrupt(self) -> list[Item]:
        """Fall silent at once. What accompanied speech that was not let go comes back, in order."""
        self._stream.interrupt()
        waiting = [item for _, item in self._waiting if item is not None]
        items = [*(held.item for held in self._held), *waiting]
        self._waiting.clear()
        self._held.clear()
        self._speaks = False
        return items

    async def moments(self) -> AsyncIterator[Moment[Item]]:
        """What is due, whenever something is, without end."""
        while True:
            block, listens = self._next_block(self._clock())
            frames = []
            if len(block):
                frames = await asyncio.to_thread(self._animated, block, listens)
            for time_s, message in frames:
                self._shown = round(time_s * SPEECH_RATE)
                yield Moment(message, list(self._due()))
            if not frames and (items := list(self._due())):
                yield Moment(None, items)
            await asyncio.sleep(BLOCK_S / 2)

    def _next_block(self, now_s: float) -> tuple[Float32Array, bool]:
        """The sound up to now, and whether it is the partner's.

        There is none where it would be too little, or speech may still come.
        """
        if self._began_s is None:
            self._began_s = now_s
        count = round((now_s - self._began_s) * SPEECH_RATE) - self._pushed
        stalled_s = max(0.0, count / SPEECH_RATE - STALL_S)
        self._began_s += stalled_s
        count -= round(stalled_s * SPEECH_RATE)
        if count < BLOCK_S * SPEECH_RATE:
            return np.zeros(0, np.float32), False
        block, may_wait = self._taken(count), count < SLACK_S * SPEECH_RATE
        listens = not (len(block) or (self._speaks and may_wait)) and len(self._heard) > 0
        if listens:
            block, self._heard = self._heard[:count], self._heard[count:]
        if not (may_wait and (self._speaks or listens)):
            self._speaks = self._speaks and len(block) == count
            block = np.concatenate([block, np.zeros(count - len(block), np.float32)])
        self._pushed += len(block)
        return block, listens

    def _taken(self, count: int) -> Float32Array:
        """Up to so many samples of speech; what accompanies them is held from now on."""
        parts, at = [np.zeros(0, np.float32)], self._pushed
        until = at + count
        while self._waiting and at < until:
            samples, item = self._waiting.popleft()
            if item is not None:
                self._held.append(_Held(at, at == self._spoken, item))
            part, rest = samples[: until - at], samples[until - at :]
            parts.append(part)
            at += len(part)
            if len(part):
                self._spoken = at
            if len(rest):
                self._waiting.appendleft((rest, None))
        return np.concatenate(parts)

    def _animated(self, block: Float32Array, listens: bool) -> list[tuple[float, dict[str, Any]]]:
        """Times and messages of the frames that a block gives."""
        frames = []
        for frame in self._stream.push(block, listen=listens):
            live = LiveFrame(self._frames, self._stream.fps, frame)
            message = {"type": MESSAGE, **frame_record(live, self._values(live))}
            frames.append((frame.time_s, message))
            self._frames += 1
        return frames

    def _due(self) -> Iterator[Item]:
        """What accompanies speech whose face is there, or that goes on from such."""
        ahead = round(SLACK_S * SPEECH_RATE)
        while self._held:
            first = self._held[0]
            if first.at > self._shown + (ahead if first.goes_on else 0):
                break
            yield self._held.popleft().item
