"""Sends frames at even times, whatever the pace at which they are made."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from elocute.array_types import Float32Array
from elocute.errors import Interrupted
from elocute.live.live_frame import LiveFrame
from elocute.live.targets import Output
from elocute.models.streaming import Frame, Stream

LATE_S = 0.1
"""A frame that is later than it should be by more is dropped: the next one is due."""


@dataclass
class Sent:
    """How many frames of a run were sent and dropped.

    `late_s` says by how many seconds each that was sent came later than the look-ahead.
    """

    sent: int
    dropped: int
    late_s: list[float]


def send_live(
    blocks: Iterable[Float32Array], rate: int, stream: Stream, outputs: Sequence[Output], fps: float
) -> Sent:
    """Animate sound while it comes in, and send each frame `lookahead_s` after its own time.

    `blocks` (sample,) come each when it was heard, `rate` samples a second; `fps` is that of the
    stream. The first block tells when the sound began. An interruption ends the sound.
    """
    waiting: queue.SimpleQueue[tuple[float, LiveFrame] | None] = queue.SimpleQueue()
    result = Sent(0, 0, [])
    sender = threading.Thread(target=_send, args=(waiting, outputs, result), daemon=True)
    sender.start()
    started, number = None, 0

    def queue_up(frames: Iterable[Frame]) -> int:
        count = number
        for frame in frames:
            due = (started or 0.0) + frame.time_s + stream.lookahead_s
            waiting.put((due, LiveFrame(count, fps, frame)))
            count += 1
        return count

    try:
        for block in blocks:
            if started is None:
                started = time.monotonic() - len(block) / rate
            number = queue_up(stream.push(block))
    except (KeyboardInterrupt, Interrupted):
        pass  # the usual end of a microphone
    number = queue_up(stream.flush())
    waiting.put(None)
    sender.join()
    return result


def _send(
    waiting: queue.SimpleQueue[tuple[float, LiveFrame] | None],
    outputs: Sequence[Output],
    result: Sent,
) -> None:
    while (each := waiting.get()) is not None:
        due, frame = each
        time.sleep(max(0.0, due - time.monotonic()))
        late_s = time.monotonic() - due
        if late_s > LATE_S:
            result.dropped += 1
            continue
        for output in outputs:
            output.send(frame)
        result.sent += 1
        result.late_s.append(late_s)
