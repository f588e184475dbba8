"""Sends frames at even times, whatever the pace at which they are made."""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from elocute.errors import Interrupted
from elocute.live.live_frame import LiveFrame, faded
from elocute.live.targets import Output
from elocute.models.streaming import Frame, Stream

LATE_S = 0.1
"""A frame that is later than it should be by more is dropped: the next one is due."""
GAP_S = 0.5
"""Sound that is later than its own pace by more was not spoken without a gap: it begins anew."""
FADE_S = 0.12
"""How long a face takes from where it was to where it goes on, once frames were skipped."""


@dataclass
class Sent:
    """What became of the frames of a run.

    `late_most_s` is by how many seconds one that was sent came later than the look-ahead at most.
    """

    sent: int = 0
    dropped: int = 0
    late_most_s: float = 0.0


class LiveRun:
    """A sound while it comes in; each frame is sent `lookahead_s` after its own time.

    Outputs with a clock of their own are told each frame as soon as it is made.

    Parameters
    ----------
    stream : Stream
        What animates it.
    outputs : sequence of Output
        Where frames go.
    sent : Sent, optional
        Of runs before, whose frames are counted on.

    Attributes
    ----------
    heard_s, given_s : float
        How much was heard, and where the next frame is, s.
    """

    def __init__(self, stream: Stream, outputs: Sequence[Output], sent: Sent | None = None) -> None:
        self.stream, self.sent = stream, sent or Sent()
        self._number = self.sent.sent + self.sent.dropped
        self._at_once = [output for output in outputs if output.has_clock]
        self._paced = [output for output in outputs if not output.has_clock]
        self._waiting: queue.SimpleQueue[tuple[float, LiveFrame] | None] = queue.SimpleQueue()
        self._began_s: float | None = None
        self.heard_s = self.given_s = 0.0
        self._last: LiveFrame | None = None
        self._fading: tuple[LiveFrame, float] | None = None
        self._sender = threading.Thread(target=self._send, daemon=True)
        self._sender.start()

    @property
    def ahead_s(self) -> float:
        """By how much more was heard than has passed since the sound began, s."""
        began_s = self._began_s
        return 0.0 if began_s is None else began_s + self.heard_s - time.monotonic()

    @property
    def shown_s(self) -> float:
        """The time of the frame that is due now."""
        return self.heard_s - self.ahead_s - self.stream.lookahead_s

    def push(self, block: NDArray[Any], *, listen: bool = False) -> None:
        """Animate a block that was heard just now, as a stream takes it."""
        self.heard_s += len(block) / self.stream.sample_rate
        if self._began_s is None or self.ahead_s < -GAP_S:
            self._began_s = time.monotonic() - self.heard_s
        self._give(self.stream.push(block, listen=listen))

    def skip(self) -> None:
        """Forget the frames that are not due yet: the next sound is heard at once.

        The face goes over to it within `FADE_S`.
        """
        self._forget_waiting()
        self._began_s = None
        if self._last is not None:
            self._fading = self._last, time.monotonic()

    def interrupt(self) -> None:
        """Forget what was heard and not shown: from now on the face comes to rest."""
        self._forget_waiting()
        self.stream.interrupt(None if self._last is None else self._last.frame)
        self._began_s = time.monotonic() - self.given_s - self.stream.lookahead_s

    def _forget_waiting(self) -> None:
        with contextlib.suppress(queue.Empty):
            while self._waiting.get_nowait():
                self.sent.dropped += 1

    def end(self) -> Sent:
        """End the sound, and wait until all is sent."""
        self._give(self.stream.flush())
        self._waiting.put(None)
        self._sender.join()
        return self.sent

    def _give(self, frames: Iterable[Frame]) -> None:
        for each in frames:
            frame = LiveFrame(self._number, self.stream.fps, each)
            self._number += 1
            self.given_s = each.time_s + 1 / self.stream.fps
            for output in self._at_once:
                output.send(frame)
            due_s = (self._began_s or 0.0) + each.time_s + self.stream.lookahead_s
            self._waiting.put((due_s, frame))

    def _send(self) -> None:
        while (each := self._waiting.get()) is not None:
            due_s, frame = each
            if not self._paced:
                self.sent.sent += 1
                continue
            time.sleep(max(0.0, due_s - time.monotonic()))
            late_s = time.monotonic() - due_s
            if late_s > LATE_S:
                self.sent.dropped += 1
                continue
            self._last = frame = self._faded(frame)
            for output in self._paced:
                output.send(frame)
            self.sent.sent += 1
            self.sent.late_most_s = max(self.sent.late_most_s, late_s)

    def _faded(self, frame: LiveFrame) -> LiveFrame:
        """The frame, or what leads over to it from where frames were skipped."""
        if self._fading is None:
            return frame
        old, since_s = self._fading
        share = (time.monotonic() - since_s) / FADE_S
        if share >= 1:
            self._fading = None
            return frame
        return faded(old, frame, share)


def send_live(blocks: Iterable[NDArray[Any]], stream: Stream, outputs: Sequence[Output]) -> Sent:
    """Animate sound while it comes in, and send its frames.

    `blocks` (sample,) come each when it was heard, at the rate of the stream. An interruption ends
    the sound.
    """
    run = LiveRun(stream, outputs)
    with contextlib.suppress(KeyboardInterrupt, Interrupted):  # the usual end of a microphone
        for block in blocks:
            run.push(block)
    return run.end()
