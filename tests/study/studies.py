"""Studies that tests make: videos of flashes and beeps, a server, and a person who asks it."""

from __future__ import annotations

import http.client
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from elocute.study.stimuli.clip_file import write_clip
from elocute.study.stimuli.stimulus_sound import RATE
from tests.support.commands import TIMEOUT_S

FPS, SECONDS = 25, 1.2
FLASHES_S = (0.4, 0.8)
FLASH_FRAMES = 3
CONDITIONS = {"ours": (60, 90, 200), "theirs": (200, 90, 60)}
SOUNDS = ("one", "two", "three")

HEAD = """
[study]
title = "Flashes"
kind = "binary"
contact = "A person, a@example.org"
"""
VIDEOS = """
[[conditions]]
name = "ours"
videos = "ours"

[[conditions]]
name = "theirs"
videos = "theirs"

[stimuli]
sounds = ["ours/*.mp4"]
size = [64, 64]
fps = 25
"""
QUICK = """
[watching]
headphones = false
practice = 0
share = 0.5

[qualification]
items = 1
right = 0

[catch]
every = 0
"""


def flashing(path: Path, colour: tuple[int, int, int], *, seconds: float = SECONDS) -> None:
    """A plain video that is white, and beeps, at `FLASHES_S`."""
    frames = round(seconds * FPS)
    pictures = np.empty((frames, 64, 64, 3), np.uint8)
    pictures[:] = colour
    samples = np.zeros(round(seconds * RATE), np.float32)
    beep = 0.5 * np.sin(2 * np.pi * 1000 * np.arange(round(0.12 * RATE)) / RATE)
    for at in FLASHES_S:
        first = round(at * FPS)
        pictures[first : first + FLASH_FRAMES] = 255
        start = round(at * RATE)
        part = samples[start : start + len(beep)]
        part[:] = beep[: len(part)]
    write_clip(path, pictures, FPS, samples)


def two_folders(folder: Path) -> None:
    """Two people's videos of the same three sentences."""
    for name, colour in CONDITIONS.items():
        (folder / name).mkdir()
        for place, sound in enumerate(SOUNDS):
            red, green, blue = colour
            flashing(folder / name / f"{sound}.mp4", (red, green + 10 * place, blue))


@contextmanager
def served(
    folder: Path, *flags: str, environment: dict[str, str] | None = None, **process: Any
) -> Iterator[str]:
    """A server of a study in a process of its own; gives its host with the port."""
    known = {k: v for k, v in os.environ.items() if not k.startswith("COVERAGE_")}
    running = subprocess.Popen(
        [sys.executable, "-m", "elocute", "study", "serve", str(folder), "--port", "0", *flags],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=known | {"OMP_NUM_THREADS": "1"} | (environment or {}),
        **process,
    )
    try:
        assert running.stdout is not None
        line = running.stdout.readline()
        assert "serving" in line, (line, running.stderr.read() if running.stderr else "")
        yield line.split("http://")[1].split("/")[0]
    finally:
        running.send_signal(signal.SIGTERM)
        running.communicate(timeout=TIMEOUT_S)


class Asker:
    """Asks a server as its page does.

    `token` is whose requests they are.
    """

    def __init__(self, host: str) -> None:
        self.host = host
        self.token = ""
        self._connection: http.client.HTTPConnection | None = None

    def close(self) -> None:
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def send(
        self,
        method: str,
        path: str,
        body: bytes | None = None,
        headers: dict[str, str] | None = None,
    ) -> tuple[int, dict[str, str], bytes]:
        """Status, fields in small letters, body. A path goes out as it is."""
        given = {"Host": self.host} | (headers or {})
        try:
            answer, data = self._sent(method, path, body, given)
        except (ConnectionError, http.client.HTTPException):
            self.close()  # the server ended a connection that was kept
            answer, data = self._sent(method, path, body, given)
        fields = {name.lower(): value for name, value in answer.getheaders()}
        if fields.get("connection", "").lower() == "close":
            self.close()
        return answer.status, fields, data

    def _sent(
        self, method: str, path: str, body: bytes | None, fields: dict[str, str]
    ) -> tuple[http.client.HTTPResponse, bytes]:
        if self._connection is None:
            self._connection = http.client.HTTPConnection(self.host, timeout=TIMEOUT_S)
        self._connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
        for name, value in fields.items():
            self._connection.putheader(name, value)
        if body is not None and "Content-Length" not in fields:
            self._connection.putheader("Content-Length", str(len(body)))
        self._connection.endheaders(body)
        answer = self._connection.getresponse()
        return answer, answer.read()

    def ask(self, path: str, body: Any = None, **headers: str) -> tuple[int, Any]:
        """Status and JSON."""
        given = {name.replace("_", "-"): value for name, value in headers.items()}
        if self.token and "Authorization" not in given:
            given["Authorization"] = f"Bearer {self.token}"
        if body is None:
            status, _, data = self.send("GET", path, None, given)
        else:
            given.setdefault("Content-Type", "application/json")
            sent = body if isinstance(body, bytes) else json.dumps(body).encode()
            status, _, data = self.send("POST", path, sent, given)
        return status, json.loads(data)

    def join(self, **more: Any) -> dict[str, Any]:
        """Take part, checks included; gives the first step."""
        status, joined = self.ask("/api/join", {"language": "en", **more})
        assert status == 201, joined
        self.token = joined["token"]
        return self.ask("/api/checks", {"width": 800})[1]

    def answer(self, step: dict[str, Any], **more: Any) -> tuple[int, Any]:
        """Answer a step with the left one, as soon as the server takes it."""
        trial = step["trial"]
        body = {
            "order": trial["order"],
            "answer": (trial["offers"] or ["50"])[0],
            "seconds": 0.5,
            "replays": 0,
        } | more
        while True:
            status, answer = self.ask("/api/answer", body)
            if status != 425:
                return status, answer
            time.sleep(0.05)
