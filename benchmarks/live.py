"""Sound to frame on the wire: when packets of `elocute live` arrive, by a real socket.

python -m benchmarks.live [SPEECH] [--minutes 0.5]
"""

from __future__ import annotations

import argparse
import json
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.read import read_audio
from elocute.live.sender import send_live
from elocute.live.targets import open_outputs
from elocute.models.streaming import stream

SPEECH = Path(__file__).parents[1] / "src/elocute/assets/example.flac"
RATE, FPS, BLOCK = 48000, 60.0, 960


class Clock:
    """The speech over and over at its own pace, and when it began."""

    def __init__(self, speech: Path, seconds: float) -> None:
        self.samples = read_audio(speech, sample_rate=RATE).samples
        self.count, self.began = round(seconds * RATE) // BLOCK, 0.0

    def blocks(self) -> Iterator[Float32Array]:
        self.began = time.monotonic()
        for number in range(self.count):
            time.sleep(max(0.0, self.began + (number + 1) * BLOCK / RATE - time.monotonic()))
            yield np.take(self.samples, number * BLOCK + np.arange(BLOCK), mode="wrap")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("speech", type=Path, nargs="?", default=SPEECH)
    parser.add_argument("--minutes", type=float, default=0.5)
    parser.add_argument("--lookahead", type=float, default=0.3)
    given = parser.parse_args()
    clock, arrived = Clock(given.speech, 60 * given.minutes), []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(2.0)

        def listen() -> None:
            try:
                while True:
                    packet = receiver.recv(65536)
                    arrived.append((time.monotonic(), json.loads(packet)["time_s"]))
            except TimeoutError:
                return

        thread = threading.Thread(target=listen)
        live = stream(RATE, fps=FPS, lookahead=given.lookahead)
        live.push(np.zeros(BLOCK, np.float32))  # the network is opened before the clock runs
        live = stream(RATE, fps=FPS, lookahead=given.lookahead)
        outputs = open_outputs([f"json=127.0.0.1:{receiver.getsockname()[1]}"])
        thread.start()
        spent = time.process_time()
        sent = send_live(clock.blocks(), live, outputs)
        spent = (time.process_time() - spent) / (60 * given.minutes)
        thread.join()
    late_s = [at - clock.began - time_s for at, time_s in arrived]
    apart_ms = 1000 * np.diff([at for at, _ in arrived])
    print(f"{sent.sent} frames sent, {sent.dropped} dropped, {len(arrived)} arrived")
    for name, values in (("after their own time, s", late_s), ("apart, ms", apart_ms)):
        told = ", ".join(f"{np.percentile(values, share):.4g}" for share in (50, 95, 99, 100))
        print(f"{name}: median, 95 %, 99 %, most {told}")
    print(f"CPU {spent:.3f} s a second of sound")


if __name__ == "__main__":
    main()
