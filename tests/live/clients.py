"""Programs that connect to `elocute live`, as others write them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray
from websockets.sync.client import ClientConnection, connect

from elocute.array_types import Float32Array
from elocute.live.ws_server import LiveServer
from tests.support.browser import PATIENCE_S

HELLO = {"type": "hello", "version": 1, "watch": {"format": "json", "shapes": "arkit"}}


class Client:
    """A connection that has been welcomed, or refused."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection

    def tell(self, kind: str, **values: Any) -> None:
        self.connection.send(json.dumps({"type": kind, **values}))

    def speak(self, samples: NDArray[np.int16], rate: int, **start: Any) -> None:
        """Send a sound at once, and end it."""
        self.tell("start", rate=rate, **start)
        self.connection.send(samples.astype("<i2").tobytes())
        self.tell("end")

    def next(self) -> dict[str, Any]:
        """The next message that is JSON."""
        while isinstance(data := self.connection.recv(timeout=PATIENCE_S), bytes):
            pass
        return json.loads(data)

    def until(self, kind: str) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """The next message of a kind, and the frames before it."""
        frames = []
        while (message := self.next())["type"] != kind:
            assert message["type"] == "frame", message
            frames.append(message)
        return message, frames


def client(server: LiveServer, **hello: Any) -> AbstractContextManager[Client]:
    """Connect to a server, and say hello."""
    return connected(server.port, **hello)


@contextmanager
def connected(port: int, **hello: Any) -> Iterator[Client]:
    """Connect to a port and say hello; what is None is left out."""
    with connect(f"ws://127.0.0.1:{port}/live", max_queue=None) as connection:
        made = Client(connection)
        said = {name: value for name, value in {**HELLO, **hello}.items() if value is not None}
        connection.send(json.dumps(said))
        yield made


def pcm(samples: Float32Array) -> NDArray[np.int16]:
    return np.round(samples * 32767).astype(np.int16)
