"""Waiting for requests; connections that ask nothing, or take no answer, keep no others out.

A connection waits while it has sent no whole request. It may wait for `WHOLE_S`; where there are
too many of one address, or in all, the one that has waited longest is ended for each new one.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections import Counter
from typing import Any, Protocol

from elocute.errors import OutputError, needs_extra

with needs_extra("serving a study", "study"):
    import h11
    import uvicorn
    from uvicorn.protocols.http.h11_impl import H11Protocol

WHOLE_S = 15.0
"""How long a request may take until it is there as a whole: 4 kB at most, and its head."""
TAKEN_S = 600.0
"""How long an answer may take until it is taken: a video of some megabytes over a phone."""
MOST = 2_000
SPARE = 400
"""Descriptors for the database, what was accepted a moment ago, and Python itself."""
EACH = 2
"""Descriptors of a connection: its own, and that of the video that it is given."""
ADDRESS_SHARE = 4
"""One address may have so many of the whole: 1 in 4."""
BACKLOG = 100
"""How many are accepted before any of them is looked at."""


def connection_limit(most: int = MOST) -> int:
    """How many connections there may be at once, up to `most` and to what the system allows.

    The process may open files for so many afterwards, where the system lets it.
    """
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return most
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = most * EACH + SPARE
    if soft != resource.RLIM_INFINITY and soft < wanted:
        raised = wanted if hard == resource.RLIM_INFINITY else min(hard, wanted)
        with contextlib.suppress(OSError, ValueError):  # else as it is
            resource.setrlimit(resource.RLIMIT_NOFILE, (raised, hard))
            soft = raised
        return max(8, min(most, (soft - SPARE) // EACH))
    return most


class Guest(Protocol):
    """Who is in a room: from where, whether it counts, and how it is ended."""

    address: str
    counted: bool

    def end(self) -> None:
        """Leave."""


class Room:
    """Who is connected, and who of them waits.

    Parameters
    ----------
    most : int
        Connections at once.
    each : int
        Of one address.
    """

    def __init__(self, most: int, each: int) -> None:
        self._most, self._each = most, each
        self._there: Counter[str] = Counter()
        self._waiting: dict[Guest, None] = {}

    def enter(self, connection: Guest) -> None:
        """Count a new one; where there are too many, the one that has waited longest leaves."""
        self._there[connection.address] += 1
        self._waiting[connection] = None
        if self._there[connection.address] > self._each:
            self._end_one(connection.address)
        elif self._there.total() > self._most:
            self._end_one(None)

    def _end_one(self, address: str | None) -> None:
        for each in self._waiting:
            if address is None or each.address == address:
                each.end()
                return

    def waits(self, connection: Guest, waits: bool) -> None:
        """Note whether one waits for a whole request of it, from now on."""
        self._waiting.pop(connection, None)
        if waits:
            self._waiting[connection] = None

    def leave(self, connection: Guest) -> None:
        """Count one less; a second time nothing happens."""
        self._waiting.pop(connection, None)
        if connection.counted:
            connection.counted = False
            self._there[connection.address] -= 1
            if not self._there[connection.address]:
                del self._there[connection.address]


class BoundedConnection(H11Protocol):
    """uvicorn's connection, with a deadline and a place in a room; `bounded` gives the room."""

    room: Room
    address = ""
    counted = False
    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Come in."""
        super().connection_made(transport)
        self.address = self.client[0] if self.client else ""
        self.counted = True
        self._within(WHOLE_S)
        self.room.enter(self)

    def data_received(self, data: bytes) -> None:
        """Take a part of a request; the time for the whole of it began with its first part."""
        waited = self._is_waiting()
        super().data_received(data)
        if not self._is_waiting():
            self.room.waits(self, False)
            self._within(TAKEN_S)
        elif not waited or self._deadline is None:
            self._within(WHOLE_S)

    def on_response_complete(self) -> None:
        """Wait for the next request; how long before it begins is uvicorn's own deadline."""
        self._within(None)
        super().on_response_complete()
        if self._is_waiting():
            self.room.waits(self, True)
        else:  # the next one had come already
            self._within(TAKEN_S)

    def connection_lost(self, exc: Exception | None) -> None:
        """Go."""
        self._within(None)
        self.room.leave(self)
        super().connection_lost(exc)

    def end(self) -> None:
        """Leave at once, whatever was sent."""
        self.room.leave(self)
        self.transport.abort()

    def _is_waiting(self) -> bool:
        """Whether the request is not whole yet."""
        return self.conn.their_state in (h11.IDLE, h11.SEND_BODY)

    def _within(self, seconds: float | None) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        self._deadline = None if seconds is None else self.loop.call_later(seconds, self.end)


def bounded(room: Room) -> Any:
    """A class of connections that share a room, as uvicorn's `http` wants it."""
    return type("BoundedConnection", (BoundedConnection,), {"room": room})


def listening(address: str, port: int) -> socket.socket:
    """A socket that takes connections at an address of this machine; port 0 takes a free one.

    Raises OutputError for an address or port that cannot be had.
    """
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    opened = socket.socket(family, socket.SOCK_STREAM)
    try:
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        opened.bind((address, port))
        opened.listen(1024)
    except (OSError, OverflowError) as error:
        opened.close()
        raise OutputError.about(
            f"{address}:{port}", found=f"cannot be listened on ({error})", allowed="a free port"
        ) from error
    return opened


def serve(app: Any, opened: socket.socket, *, behind_proxy: bool = False) -> None:
    """Answer until the process is told to end, and close the socket.

    With `behind_proxy`, a server on this machine passes requests on, and says who asks.
    """
    most = connection_limit()
    # A proxy has all connections to itself, and a limit of its own for each who asks.
    room = Room(most, most if behind_proxy else max(8, most // ADDRESS_SHARE))
    config = uvicorn.Config(
        app,
        http=bounded(room),
        ws="none",
        lifespan="off",
        log_level="error",
        access_log=False,
        server_header=False,
        proxy_headers=behind_proxy,
        forwarded_allow_ips="127.0.0.1" if behind_proxy else "",
        timeout_keep_alive=20,
        timeout_graceful_shutdown=5,
        backlog=BACKLOG,
        h11_max_incomplete_event_size=16_384,
    )
    try:
        uvicorn.Server(config).run(sockets=[opened])
    finally:
        opened.close()
