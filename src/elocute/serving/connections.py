"""Waiting for requests; connections that ask nothing, or take no answer, keep no others out.

A connection waits while it has sent no whole request. It may wait for `WHOLE_S`; where there are
too many of one address, or in all, the one that has waited longest is ended for each new one.
"""

from __future__ import annotations

import asyncio
import socket
from typing import Any

from elocute.errors import needs_extra
from elocute.serving.listening import Room, connection_limit

with needs_extra("serving pages", "study"):
    import h11
    import uvicorn
    from uvicorn.protocols.http.h11_impl import H11Protocol

WHOLE_S = 15.0
"""How long a request may take until it is there as a whole: 4 kB at most, and its head."""
TAKEN_S = 600.0
"""How long an answer may take until it is taken: a video of some megabytes over a phone."""
ADDRESS_SHARE = 4
"""One address may have so many of the whole: 1 in 4."""
BACKLOG = 100
"""How many are accepted before any of them is looked at."""


class BoundedConnection(H11Protocol):
    """uvicorn's connection, with a deadline and a place in a room; `bounded` gives the room."""

    room: Room
    whole_s: float | None = None
    address = ""
    counted = False
    _deadline: asyncio.TimerHandle | None = None
    _handed_over = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Come in."""
        super().connection_made(transport)
        self.address = self.client[0] if self.client else ""
        self.counted = True
        self._within(self.whole_s or WHOLE_S)
        self.room.enter(self)

    def data_received(self, data: bytes) -> None:
        """Take a part of a request; the time for the whole of it began with its first part."""
        waited = self._is_waiting()
        super().data_received(data)
        if self._handed_over:
            return
        if not self._is_waiting():
            self.room.waits(self, False)
            self._within(TAKEN_S)
        elif not waited or self._deadline is None:
            self._within(self.whole_s or WHOLE_S)

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Become another protocol, which has limits of its own."""
        self._handed_over = True
        self._within(None)
        self.room.leave(self)
        super().handle_websocket_upgrade(event)

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


def bounded(room: Room, whole_s: float | None = None) -> Any:
    """A class of connections that share a room, as uvicorn's `http` wants it; whole_s: how long a
    request may take, `WHOLE_S` by default."""
    return type("BoundedConnection", (BoundedConnection,), {"room": room, "whole_s": whole_s})


def serve(
    app: Any,
    opened: socket.socket,
    *,
    behind_proxy: bool = False,
    whole_s: float | None = None,
    message_max_bytes: int = 0,
) -> None:
    """Answer until the process is told to end, and close the socket.

    With `behind_proxy`, a server on this machine passes requests on, and says who asks.
    `whole_s`: how long a request may take until it is there. `message_max_bytes`: of a message that
    comes in by a WebSocket; with 0 there are no WebSockets.
    """
    most = connection_limit()
    # A proxy has all connections to itself, and a limit of its own for each who asks.
    room = Room(most, most if behind_proxy else max(8, most // ADDRESS_SHARE))
    config = uvicorn.Config(
        app,
        http=bounded(room, whole_s),
        ws="websockets-sansio" if message_max_bytes else "none",
        ws_max_size=message_max_bytes,
        ws_per_message_deflate=False,
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
