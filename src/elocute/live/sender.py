"""Sends frames at even times, whatever the pace at which they are made."""

from __future__ import annotations

import itertools
import queue
import threading
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from elocute.array_types import Float32Array
from elocute.errors import Interrupted
from elocute.live.live_frame import LiveFrame
from elocute.live.targets import Output
from elocute.models.streaming import Frame, Stream

LATE_S = 0.1
"""A frame that is later than it should be by more is dropped: the next one is due."""


@dataclass(frozen=True)
class Sent:
    """What became of the frames of a run.

    `late_s` has by how many seconds each that was sent came later than the look-ahead, `dropped_s`
    the same of those that were dropped.
    """

    late_s: list[float] = field(default_factory=list)
    dropped_s: list[float] = field(default_factory=list)


def send_live(blocks: Iterable[Float32Array], stream: Stream, outputs: Sequence[Output]) -> Sent:
    """Animate sound while it comes in, and send each frame `lookahead_s` after its own time.

    `blocks` (sample,) come each when it was heard, at the rate of the stream. The first one tells
    when the sound began. An interruption ends the sound.
    """
    waiting: queue.SimpleQueue[tuple[float, LiveFrame] | None] = queue.SimpleQueue()
    sent, numbers = Sent(), itertools.count()
    sender = threading.Thread(target=_send, args=(waiting, outputs, sent), daemon=True)
    sender.start()
    began_s = None

    def queue_up(frames: Iterable[Frame]) -> None:
        for frame in frames:
            due_s = (began_s or 0.0) + frame.time_s + stream.lookahead_s
            waiting.put((due_s, LiveFrame(next(numbers), stream.fps, frame)))

    try:
        for block in blocks:
            if began_s is None:
                began_s = time.monotonic() - len(block) / stream.sample_rate
            queue_up(stream.push(block))
    except (KeyboardInterrupt, Interrupted):
        pass  # the usual end of a microphone
    queue_up(stream.flush())
    waiting.put(None)
    sender.join()
    return sent


def _send(
    waiting: queue.SimpleQueue[tuple[float, LiveFrame] | None],
    outputs: Sequence[Output],
    sent: Sent,
) -> None:
    while (each := waiting.get()) is not None:
        due_s, frame = each
        time.sleep(max(0.0, due_s - time.monotonic()))
        late_s = time.monotonic() - due_s
        if late_s > LATE_S:
            sent.dropped_s.append(late_s)
            continue
        for output in outputs:
            output.send(frame)
        sent.late_s.append(late_s)
