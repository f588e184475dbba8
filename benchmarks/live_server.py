"""A live server under attack and load: malformed messages, receivers that die, full queues.

python -m benchmarks.live_server [--messages 100000] [--seed 0]

Strangers send what is malformed in every way that the protocol has, on bytes of the connection, of
HTTP and of the WebSocket. Meanwhile one program speaks at its own pace and another watches: every
frame must reach it, in order and with its values. Receivers are killed and come again, one never
reads. Exit code 1 where something of it fails.
"""

from __future__ import annotations

import argparse
import base64
import json
import os
import random
import resource
import socket
import struct
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.sync.client import connect

from elocute.audio.read import read_audio
from elocute.live.protocol import MESSAGE_MAX_BYTES
from elocute.live.targets import Access
from elocute.live.ws_server import LiveServer
from elocute.models.streaming import stream

SPEECH = Path(__file__).parents[1] / "src/elocute/assets/example.flac"
RATE, LOOKAHEAD_S, BLOCK = 16000, 0.25, 320
HELLO = {"type": "hello", "version": 1, "watch": {"format": "json", "shapes": "arkit"}}
WATCHER = """
import json, sys
from websockets.sync.client import connect
with connect(sys.argv[1], max_queue=None) as watched:
    watched.send(json.dumps({"type": "hello", "version": 1, "watch": {}}))
    for text in watched:
        pass
"""
VALUES = [
    None,
    True,
    -1,
    0,
    1e308,
    10**17,
    "",
    "main",
    "\0",
    "é" * 50,
    [],
    {},
    [[]] * 20,
    "x" * 999,
]
WORDS = ["type", "hello", "version", "watch", "format", "shapes", "face", "token", "start", "rate"]
WORDS += ["channels", "listen", "on", "interrupt", "end", "json", "binary", "arkit", "message"]


def texts(chance: random.Random) -> str | bytes:
    """A message that is malformed, or comes where it should not."""
    kind = chance.randrange(5)
    if kind == 0:
        return chance.randbytes(chance.randrange(200))
    if kind == 1:
        return chance.randbytes(chance.randrange(200)).decode("latin-1")
    record = {
        chance.choice(WORDS): chance.choice([*VALUES, *WORDS, chance.randrange(1 << 20)])
        for _ in range(chance.randrange(4))
    }
    text = json.dumps({"type": chance.choice(WORDS), **record})
    if kind == 2:
        return text
    at = chance.randrange(len(text))
    return (
        text[:at] + chance.choice(["", "[", "{", '"', "\\u0000", "NaN", "1e999"]) + text[at + 1 :]
    )


def wire(chance: random.Random) -> bytes:
    """Bytes where a request, or a frame of a WebSocket, should be."""
    kind = chance.randrange(3)
    if kind == 0:
        return chance.randbytes(chance.randrange(1, 400))
    key = base64.b64encode(chance.randbytes(16)).decode()
    lines = [
        f"{chance.choice(['GET', 'POST', 'PUT', chr(0)])} "
        f"{chance.choice(['/', '/live', '/' * 3000])} "
        f"HTTP/{chance.choice(['1.1', '1.0', '9', ''])}",
        f"Host: {chance.choice(['127.0.0.1', 'studio.example', ''])}",
        f"Upgrade: {chance.choice(['websocket', 'h2c'])}",
        "Connection: Upgrade",
        f"Sec-WebSocket-Key: {chance.choice([key, 'no'])}",
        f"Sec-WebSocket-Version: {chance.choice(['13', '8'])}",
        f"X: {'y' * chance.choice([1, 9000])}",
    ]
    if kind == 2:
        chance.shuffle(lines)
    return "\r\n".join([*lines, "", ""]).encode()


def frames(chance: random.Random) -> bytes:
    """A frame of a WebSocket: opcodes, lengths and masks that are right or not."""
    length = chance.choice([0, 5, 125, 126, 127, MESSAGE_MAX_BYTES + 1])
    head = bytes([chance.randrange(256), chance.choice([0, 128]) | min(length, 127)])
    if length > 126:
        head += struct.pack(">Q", length)
    return head + chance.randbytes(min(length, 200) + 4)


class Attack:
    """Sends what is malformed until so many were sent."""

    def __init__(self, port: int, count: int, seed: int) -> None:
        self.url, self.port, self.left = f"ws://127.0.0.1:{port}/live", port, count
        self.shut_out = 0
        self.chance, self.sent = random.Random(seed), Counter[str]()

    def run(self) -> None:
        while self.left > 0:
            ways = [self.talk, self.talk, self.talk, self.knock, self.break_frames]
            try:
                self.chance.choice(ways)()
            except InvalidHandshake:
                self.shut_out += 1
            except (OSError, ConnectionClosed, EOFError):
                continue

    def count(self, kind: str) -> None:
        self.sent[kind] += 1
        self.left -= 1

    def talk(self) -> None:
        face = f"face{self.chance.randrange(3)}"  # not the main one, which another moves
        with connect(self.url, max_queue=None, close_timeout=1, proxy=None) as one:
            if self.chance.random() < 0.9:
                one.send(json.dumps({**HELLO, "face": face}))
            for _ in range(80):  # the server closes it after 50 faults
                one.send(texts(self.chance))
                self.count("messages")

    def knock(self) -> None:
        for _ in range(10):
            with socket.create_connection(("127.0.0.1", self.port), timeout=1) as one:
                one.sendall(wire(self.chance))
                self.count("requests")
                if self.chance.random() < 0.1:  # half of them wait for more
                    one.settimeout(0.2)
                    one.recv(1000)

    def break_frames(self) -> None:
        with connect(self.url, max_queue=None, close_timeout=1, proxy=None) as one:
            one.send(json.dumps({**HELLO, "face": "broken"}))
            for _ in range(20):
                one.socket.sendall(frames(self.chance))
                self.count("frames")


class Speaker:
    """Speech over and over at its own pace, and what must come back."""

    def __init__(self) -> None:
        samples = read_audio(SPEECH, sample_rate=RATE).samples
        self.pcm = np.round(samples * 32767).astype("<i2")
        self.ended = threading.Event()
        self.pushed = 0

    def run(self, url: str) -> None:
        with connect(url, max_queue=None, proxy=None) as one:
            one.send(json.dumps({**HELLO, "watch": None}))
            one.send(json.dumps({"type": "start", "rate": RATE}))
            began = time.monotonic()
            while not self.ended.is_set():
                time.sleep(max(0.0, began + (self.pushed + BLOCK) / RATE - time.monotonic()))
                block = np.take(self.pcm, self.pushed + np.arange(BLOCK), mode="wrap")
                one.send(block.tobytes())
                self.pushed += BLOCK
            one.send(json.dumps({"type": "end"}))
            while json.loads(one.recv(timeout=600))["type"] != "ended":  # leaving voids what waits
                pass

    def wanted(self) -> Iterator[dict[str, float]]:
        from elocute.live.live_frame import LiveFrame

        live = stream(RATE, lookahead=LOOKAHEAD_S)
        for at in range(0, self.pushed, RATE):
            block = np.take(self.pcm, np.arange(at, min(at + RATE, self.pushed)), mode="wrap")
            for frame in live.push(block.astype(np.float32) / 32768):
                yield LiveFrame(0, 60.0, frame).arkit


def watch(url: str, seen: list[str | bytes], ended: threading.Event) -> None:
    with suppress(ConnectionClosed), connect(url, max_queue=None, proxy=None) as one:
        one.send(json.dumps(HELLO))
        while not ended.is_set():
            with suppress(TimeoutError):
                seen.append(one.recv(timeout=0.5))


def disturb(url: str, ended: threading.Event, killed: Counter[str]) -> None:
    """Receivers are killed and started again; one never reads what it is sent."""
    # It would end itself, as no answer to its pings is read.
    with (
        suppress(ConnectionClosed),
        connect(url, max_queue=1, ping_interval=None, proxy=None) as deaf,
    ):
        deaf.send(json.dumps(HELLO))
        while not ended.is_set():
            process = subprocess.Popen([sys.executable, "-c", WATCHER, url])
            ended.wait(1.5)
            process.kill()
            process.wait()
            killed["receivers"] += 1
        killed["deaf"] = 1


def memory_mb() -> float:
    """Of this process now, where the system tells; else the most it ever was."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return pages * resource.getpagesize() / 1e6
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--messages", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    server = LiveServer(("127.0.0.1", 0), Access())
    server.hear(lambda rate: stream(rate, lookahead=LOOKAHEAD_S))
    url, speaker, seen = f"ws://127.0.0.1:{server.port}/live", Speaker(), []
    ended, killed = threading.Event(), Counter[str]()
    attack = Attack(server.port, given.messages, given.seed)
    watcher = threading.Thread(target=watch, args=(url, seen, ended))
    speaking = threading.Thread(target=speaker.run, args=(url,))
    disturbing = threading.Thread(target=disturb, args=(url, ended, killed))
    for each in (watcher, speaking, disturbing):
        each.start()
    time.sleep(3)
    before_mb, began = memory_mb(), time.monotonic()
    attack.run()
    spent_s, after_mb = time.monotonic() - began, memory_mb()
    speaker.ended.set()
    speaking.join()
    time.sleep(2)
    ended.set()
    for each in (watcher, disturbing):
        each.join()
    server.close()
    return report(attack, speaker, seen, killed, spent_s, (before_mb, after_mb), server)


def report(
    attack: Attack,
    speaker: Speaker,
    texts: list[str | bytes],
    killed: Counter[str],
    spent_s: float,
    memory: tuple[float, float],
    server: LiveServer,
) -> int:
    """Print what was; 1 where a frame is missing or wrong."""
    told = [json.loads(text) for text in texts]
    seen = [record for record in told if record["type"] == "frame"]
    others = Counter(record["type"] for record in told if record["type"] != "frame")
    numbers, most, spoken = [record["frame"] for record in seen], 0.0, 0
    until_s = speaker.pushed / RATE - LOOKAHEAD_S
    watched = {record["frame"]: record for record in seen if record["time_s"] < until_s}
    for number, curves in enumerate(speaker.wanted()):
        if (record := watched.get(number)) is not None:
            spoken += 1
            most = max(most, *(abs(record["curves"].get(k, 0) - v) for k, v in curves.items()))
    missing = sum(np.diff(numbers) != 1) if numbers else -1
    print(f"{sum(attack.sent.values())} malformed in {spent_s:.0f} s: {dict(attack.sent)}")
    print(
        f"{killed['receivers']} receivers killed; {server.main.failures} frames lost by slow ones"
    )
    print(f"{len(numbers)} frames watched, {missing} gaps; {spoken} spoken, {most:.1e} off at most")
    print(f"the watcher was told besides: {dict(others)}")
    print(f"{attack.shut_out} connections of the attack were shut out")
    print(f"memory {memory[0]:.0f} MB before, {memory[1]:.0f} MB after")
    return int(missing != 0 or most > 1e-3 or spoken < 0.9 * len(watched))


if __name__ == "__main__":
    sys.exit(main())
