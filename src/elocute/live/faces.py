"""Faces that several programs watch, and the voices that move them."""

from __future__ import annotations

import asyncio
import contextlib
import queue
import sys
import threading
from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from elocute.audio.pcm import PcmBytes
from elocute.errors import ElocuteError
from elocute.live.live_frame import LiveFrame
from elocute.live.protocol import (
    Control,
    Interrupt,
    Listen,
    Start,
    Watch,
    encoded,
    message,
)
from elocute.live.sender import LiveRun, Sent
from elocute.live.sources import BLOCK_S
from elocute.live.targets import Output
from elocute.models.streaming import Stream

FRAMES_MAX = 3_600
"""Frames that wait for a receiver; where there are more, it is too slow, and loses them all."""
AHEAD_S = 120.0
"""Sound that may wait for a voice; more is not read until there is room."""
TAKEN_S = 0.1
"""Sound that is animated at a time, so that an interruption is not waited for."""
SPARE_S = 0.1
"""How long before they are due frames of silence are made."""
REST_S = 0.5
"""Silence after a voice that has left, in which its mouth comes to rest."""
StreamOpener = Callable[[int], Stream]
"""A new stream for sound of a rate in Hz."""


class Outbox:
    """What waits to be sent to one receiver, frames at most `FRAMES_MAX`."""

    def __init__(self, watch: Watch | None) -> None:
        self.watch, self.lost = watch, 0
        self._waiting: deque[tuple[bool, str | bytes]] = deque()
        self._frames = 0
        self._there = asyncio.Event()

    def put(self, data: str | bytes, *, is_frame: bool = False) -> None:
        """Let something wait. A receiver that is too slow loses frames, and is told how many."""
        if is_frame and self._frames >= FRAMES_MAX:
            lost = self.drop_frames()
            self.lost += lost
            self.put(message("dropped", frames=lost))
        self._waiting.append((is_frame, data))
        self._frames += is_frame
        self._there.set()

    def drop_frames(self) -> int:
        """Forget the frames that wait; how many they were."""
        dropped, self._frames = self._frames, 0
        self._waiting = deque(each for each in self._waiting if not each[0])
        return dropped

    async def next(self) -> str | bytes:
        """What has waited longest."""
        while not self._waiting:
            self._there.clear()
            await self._there.wait()
        is_frame, data = self._waiting.popleft()
        self._frames -= is_frame
        return data


class Face:
    """Who watches a face. Any thread may send frames; receivers come and go in the loop's own."""

    has_clock = True

    def __init__(self, loop: asyncio.AbstractEventLoop, address: str = "") -> None:
        self.address, self.failures = address, 0
        self.voice: Voice | None = None
        self.sent = Sent()
        self._loop = loop
        self._boxes: set[Outbox] = set()
        self._wanted: frozenset[Watch] = frozenset()

    @property
    def is_empty(self) -> bool:
        """Whether nobody is here."""
        return not self._boxes and self.voice is None

    def enter(self, box: Outbox) -> None:
        """Let a receiver in."""
        self._boxes.add(box)
        self._note_wanted()

    def leave(self, box: Outbox) -> None:
        """Let it go."""
        self._boxes.discard(box)
        self.failures += box.lost
        self._note_wanted()

    def _note_wanted(self) -> None:
        self._wanted = frozenset(box.watch for box in self._boxes if box.watch is not None)

    def send(self, frame: LiveFrame) -> None:
        """Send a frame to all that watch, each as it wants it."""
        if wanted := self._wanted:
            data = {watch: encoded(frame, watch) for watch in wanted}
            self._later(lambda: self._deliver(data))

    def tell(self, text: str, *, void: bool = False) -> None:
        """Send a message to all; with `void` the frames that wait are forgotten."""

        def put() -> None:
            for box in self._boxes:
                if void:
                    box.drop_frames()
                box.put(text)

        self._later(put)

    def close(self) -> None:
        """Nothing is open."""

    def _deliver(self, data: dict[Watch, str | bytes]) -> None:
        for box in self._boxes:
            if box.watch in data:
                box.put(data[box.watch], is_frame=True)

    def _later(self, call: Callable[[], None]) -> None:
        with contextlib.suppress(RuntimeError):  # the server has ended
            self._loop.call_soon_threadsafe(call)


class Voice:
    """Sound that a program sends, animated in a thread of its own.

    Between two sounds it goes on with silence at its own pace, so that the face lives.

    Parameters
    ----------
    face : Face
        What it moves.
    outputs : sequence of Output
        Where its frames go besides.
    open_stream : callable
        A new stream.

    Attributes
    ----------
    leaves : bool
        Whether it was told to leave.
    """

    def __init__(self, face: Face, outputs: Sequence[Output], open_stream: StreamOpener) -> None:
        self._face, self._outputs, self._open_stream = face, [face, *outputs], open_stream
        self._coming: queue.SimpleQueue[Control | bytes | None] = queue.SimpleQueue()
        self._bytes, self._lock = 0, threading.Lock()
        self._void = threading.Event()  # what comes until an interruption is done
        self._start = Start(48000, 1)
        self._run: LiveRun | None = None
        self._pcm, self._listens, self._within = PcmBytes(), False, False
        self._quiet_s = 0.0  # where the last sound ended
        self.leaves = False
        self._thread = threading.Thread(target=self._speak, daemon=True)
        self._thread.start()

    @property
    def speaks(self) -> bool:
        """Whether it takes anything more."""
        return self._thread.is_alive()

    @property
    def ahead_s(self) -> float:
        """How much sound waits, s."""
        return self._bytes / (2 * self._start.rate * self._start.channels)

    def take(self, what: Control | bytes) -> None:
        """Take a control, or bytes of sound."""
        if isinstance(what, Interrupt):
            self._void.set()
            self._forget_coming()
        elif isinstance(what, bytes):
            self._count(len(what))
        self._coming.put(what)

    def leave(self) -> None:
        """Say nothing more."""
        self.leaves = True
        self._void.set()
        self._forget_coming()
        self._coming.put(None)

    def join(self) -> None:
        """Wait until all is sent."""
        self._thread.join()

    def _forget_coming(self) -> None:
        """Forget the sound that was not animated yet, not what was said about it."""
        kept = []
        with contextlib.suppress(queue.Empty):
            while True:
                what = self._coming.get_nowait()
                if isinstance(what, bytes):
                    self._count(-len(what))
                else:
                    kept.append(what)
        for what in kept:
            self._coming.put(what)

    def _count(self, more: int) -> None:
        with self._lock:
            self._bytes += more

    def _speak(self) -> None:
        try:
            while (what := self._next()) is not None:
                self._do(what)
            if self._run is not None:
                self._run.interrupt()
                self._be_silent(REST_S)
                self._run.end()
        except ElocuteError as error:
            self._face.tell(message("error", error="failed", message=str(error)))
            print(f"elocute: {error}", file=sys.stderr, flush=True)

    def _next(self) -> Control | bytes | None:
        """What comes next; silence ahead of its time, where nothing comes and none is spoken."""
        while self._run is not None and not self._within:
            spare_s = self._run.ahead_s - self._run.stream.lookahead_s - SPARE_S
            try:
                return self._coming.get(timeout=max(0.001, spare_s + BLOCK_S))
            except queue.Empty:
                if spare_s < 0:
                    self._be_silent(BLOCK_S)
        return self._coming.get()

    def _be_silent(self, seconds: float) -> None:
        assert self._run is not None
        self._run.push(np.zeros(round(seconds * self._start.rate), np.float32))

    def _do(self, what: Control | bytes) -> None:
        if isinstance(what, bytes):
            self._count(-len(what))
            self._hear(what)
        elif isinstance(what, Start):
            self._begin(what)
        elif isinstance(what, Listen):
            self._listens = what.on
        elif self._run is not None:
            self._stop(self._run, interrupted=isinstance(what, Interrupt))

    def _begin(self, start: Start) -> None:
        if self._run is not None and self._within:
            self._stop(self._run, interrupted=False)
        if self._run is None or start.rate != self._start.rate:
            if self._run is not None:
                self._run.end()
            self._quiet_s = 0.0
            self._run = LiveRun(self._open_stream(start.rate), self._outputs, self._face.sent)
        self._start, self._pcm, self._within = start, PcmBytes(start.channels), True
        if self._run.shown_s >= self._quiet_s:  # silence alone was made ahead
            self._run.skip()
        self._face.tell(message("started", time_s=round(self._run.heard_s, 4)))

    def _stop(self, run: LiveRun, *, interrupted: bool) -> None:
        """End a sound: what it has of frames comes at once, or is void."""
        self._within, self._quiet_s = False, run.heard_s
        if interrupted:
            self._void.clear()
            run.interrupt()
            self._face.tell(message("interrupted", time_s=round(run.given_s, 4)), void=True)
        else:
            ended_s = round(run.heard_s, 4)
            self._be_silent(run.stream.lookahead_s + BLOCK_S)
            self._face.tell(message("ended", time_s=ended_s))

    def _hear(self, data: bytes) -> None:
        """Animate bytes of sound, in pieces; what was interrupted meanwhile is left."""
        if self._run is None or not self._within:
            return
        samples = self._pcm.push(data)
        size = round(TAKEN_S * self._start.rate)
        for at in range(0, len(samples), size):
            if self._void.is_set():
                return
            self._run.push(samples[at : at + size], listen=self._listens)
