"""A WebSocket server of this machine: sound comes in, frames go out, and a page shows them."""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import logging
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from http import HTTPStatus
from socket import socket

from elocute.errors import InputError, needs_extra
from elocute.live.faces import AHEAD_S, Face, Outbox, StreamOpener, Voice
from elocute.live.live_frame import LiveFrame
from elocute.live.protocol import (
    MAIN_FACE,
    MESSAGE_MAX_BYTES,
    Hello,
    Start,
    read_control,
    read_hello,
    refused,
    welcome,
)
from elocute.live.targets import Access, Output
from elocute.numerics.quaternions import no_turn
from elocute.serving.gate import HEADERS, Gate, Rates, fields_of, host_names
from elocute.serving.listening import Room, connection_limit, listening

with needs_extra("a WebSocket", "live"):
    from websockets.asyncio.server import ServerConnection, serve
    from websockets.datastructures import Headers
    from websockets.exceptions import ConnectionClosed
    from websockets.http11 import Request, Response

PATH, PAGE = "/live", "/"
WHOLE_S = 20.0
"""How long the opening of a connection may take, and the first message after it."""
LEAVE_S = 2.0
"""How long connections have to close when the server ends, or ends them."""
CONNECTIONS, VOICES = 128, 8
"""How many there may be at once."""
FAULTS_MAX = 50
"""Messages of a connection that may be refused; then it is closed."""
WAIT_S = 0.05
SILENT = logging.Logger("elocute.live", logging.CRITICAL + 1)
"""What strangers send is no news."""
LOCAL_HOSTS = ("localhost", "127.0.0.1", "[::1]")
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' blob:; style-src 'unsafe-inline'; "
    "img-src data: blob:; connect-src 'self' blob:; worker-src blob:; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'"
)
PAGE_HEADERS = {
    **HEADERS,
    "content-type": "text/html; charset=utf-8",
    "content-security-policy": POLICY,
    "permissions-policy": "camera=(), geolocation=(), microphone=(self)",
    "cache-control": "no-store",
}


class LiveServer:
    """Serves faces to all that watch them, from a thread of its own, until it is closed.

    As an output it is the main face. With `hear` connections may also send sound.

    Parameters
    ----------
    place : (str, int)
        Numeric address and port to listen on; port 0 takes a free one.
    access : Access
        Who may connect.

    Raises
    ------
    OutputError
        Where that cannot be listened on; MachineError without the extra `live`.
    """

    has_clock = True

    def __init__(self, place: tuple[str, int], access: Access) -> None:
        opened = listening(*place)
        self.port: int = opened.getsockname()[1]
        host = f"[{place[0]}]" if ":" in place[0] else place[0]
        self.address = f"http://{host}:{self.port}/"
        self._token = access.token
        if access.token:
            self.address += f"#token={access.token}"
        self._gate = Gate(
            host_names([*LOCAL_HOSTS, host], self.port),
            Rates(4_000, 2_000),
            origins=access.origins,
            numeric=access.allow_remote,
        )
        self._guessing = Rates(10, 0.2)
        self._room = Room(connection_limit(CONNECTIONS), CONNECTIONS)
        self._loop = asyncio.new_event_loop()
        self.main = Face(self._loop)
        self._faces = {MAIN_FACE: self.main}
        self._open_stream: StreamOpener | None = None
        self._outputs: Sequence[Output] = ()
        self._ended = asyncio.Event()
        self._thread = threading.Thread(target=self._serve, args=(opened,), daemon=True)
        self._thread.start()

    @property
    def failures(self) -> int:
        """Frames that receivers of the main face were too slow for."""
        return self.main.failures

    def send(self, frame: LiveFrame) -> None:
        """Send a frame of the main face."""
        self.main.send(frame)

    def hear(self, open_stream: StreamOpener, outputs: Sequence[Output] = ()) -> None:
        """Let connections send sound; what moves the main face goes to more outputs."""
        self._outputs = [output for output in outputs if output is not self]
        self._open_stream = open_stream

    def close(self) -> None:
        """End all voices and connections."""
        voices = [face.voice for face in list(self._faces.values()) if face.voice is not None]
        for voice in voices:
            voice.leave()
        for voice in voices:
            voice.join()
        with contextlib.suppress(RuntimeError):  # it has ended before
            self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join()

    def _serve(self, opened: socket) -> None:
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
            runner.run(self._wait(opened))

    async def _wait(self, opened: socket) -> None:
        there: set[_Connection] = set()
        connection = type("_Connection", (_Connection,), {"room": self._room, "there": there})
        server = serve(
            self._talk,
            sock=opened,
            process_request=self._answer,
            create_connection=connection,
            compression=None,
            server_header=None,
            open_timeout=WHOLE_S,
            close_timeout=WHOLE_S,
            max_size=MESSAGE_MAX_BYTES,
            logger=SILENT,
        )
        made = await server
        await self._ended.wait()
        made.close()
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(made.wait_closed(), LEAVE_S)
        for each in list(there):
            each.transport.abort()
        await made.wait_closed()

    async def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """What is answered to a request; None lets it become a WebSocket."""
        path = request.path.partition("?")[0]
        headers = [
            (n.encode("latin-1"), v.encode("latin-1")) for n, v in request.headers.raw_items()
        ]
        refusal = self._gate.refusal(_sender(connection), fields_of(headers), is_page=path == PAGE)
        if refusal is not None:
            return _response(refusal[0], refusal[1].encode(), HEADERS)
        if path == PATH:
            return None
        if path != PAGE:
            return _response(404, b"unknown", HEADERS)
        return _response(200, await asyncio.to_thread(_page), PAGE_HEADERS)

    async def _talk(self, connection: ServerConnection) -> None:
        assert isinstance(connection, _Connection)
        self._room.waits(connection, False)
        with contextlib.suppress(ConnectionClosed, TimeoutError):
            async with asyncio.timeout(WHOLE_S):
                hello = await self._hello(connection)
            if hello is not None:
                await self._attend(connection, hello)

    async def _hello(self, connection: ServerConnection) -> Hello | None:
        """The first message, None where it was refused."""
        try:
            first = await connection.recv()
            hello = read_hello(first if isinstance(first, str) else "")
            if self._token and not self._knows_token(hello.token, _sender(connection)):
                raise InputError.about("`token`", found="another", allowed="the server's own")
        except InputError as error:
            with contextlib.suppress(ConnectionClosed):
                await connection.send(refused(error))
            await _end(connection, "hello")
            return None
        return hello

    def _knows_token(self, token: str, sender: str) -> bool:
        same = hmac.compare_digest(token.encode("utf-8", "replace"), self._token.encode())
        return self._guessing.allows(sender) and same

    async def _attend(self, connection: ServerConnection, hello: Hello) -> None:
        """Frames of a face go out, and what moves it comes in, until the connection ends."""
        box = Outbox(hello.watch)
        box.put(welcome(hello.watch))
        face = self._faces.setdefault(hello.face, Face(self._loop))
        face.enter(box)
        sending = self._loop.create_task(_send_all(connection, box))
        talker = _Talker(face, self._voice_of)
        try:
            await _hear_all(connection, talker, box)
        finally:
            sending.cancel()
            face.leave(box)
            await talker.leave()
            if face is not self.main and face.is_empty:
                self._faces.pop(hello.face, None)

    def _voice_of(self, face: Face) -> Voice:
        """A new voice for a face that has none. Raises InputError where there can be none."""
        if self._open_stream is None:
            raise InputError.about("`start`", found="a face with a source of its own")
        if sum(each.voice is not None for each in self._faces.values()) >= VOICES:
            raise InputError.about("`start`", found=f"{VOICES} voices", allowed="no more")
        return Voice(face, self._outputs if face is self.main else (), self._open_stream)


class _Connection(ServerConnection):
    """A connection with a place in a room."""

    room: Room
    there: set[_Connection]
    address = ""
    counted = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self.address, self.counted = _sender(self), True
        self.there.add(self)
        self.room.enter(self)

    def connection_lost(self, exc: Exception | None) -> None:
        self.there.discard(self)
        self.room.leave(self)
        super().connection_lost(exc)

    def end(self) -> None:
        """Leave at once."""
        self.room.leave(self)
        self.transport.abort()


class _Talker:
    """One connection's part in moving a face."""

    def __init__(self, face: Face, voice_of: Callable[[Face], Voice]) -> None:
        self._face, self._voice_of = face, voice_of
        self._voice: Voice | None = None

    async def take(self, data: str | bytes) -> None:
        """Take a message, once there is room for it. Raises InputError for what cannot be."""
        what = data if isinstance(data, bytes) else read_control(data)
        if self._voice is not None and not self._voice.speaks:  # it failed
            self._voice = self._face.voice = None
        if self._voice is None:
            if not isinstance(what, Start):
                raise InputError.about("message", found="one before `start`", allowed="`start`")
            await self._wait_for_face()
            self._face.voice = self._voice = self._voice_of(self._face)
        while self._voice.ahead_s > AHEAD_S:
            await asyncio.sleep(WAIT_S)
        self._voice.take(what)

    async def _wait_for_face(self) -> None:
        """Wait while a voice that has left comes to rest."""
        while (voice := self._face.voice) is not None:
            if not voice.leaves:
                raise InputError.about(
                    "`start`", found="a face that another moves", allowed="one that nobody moves"
                )
            await asyncio.sleep(WAIT_S)

    async def leave(self) -> None:
        """End the voice, and wait until the face has come to rest."""
        if self._voice is not None:
            self._voice.leave()
            while self._voice.speaks:
                await asyncio.sleep(WAIT_S)
            if self._face.voice is self._voice:
                self._face.voice = None


async def _hear_all(connection: ServerConnection, talker: _Talker, box: Outbox) -> None:
    faults = 0
    async for data in connection:
        try:
            await talker.take(data)
        except InputError as error:
            faults += 1
            box.put(refused(error))
            if faults > FAULTS_MAX:
                await _end(connection, "too many faults")
                return


async def _end(connection: ServerConnection, reason: str) -> None:
    """Close a connection; who does not answer soon keeps no place."""
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(LEAVE_S):
            await connection.close(1008, reason)
    connection.transport.abort()


async def _send_all(connection: ServerConnection, box: Outbox) -> None:
    with contextlib.suppress(ConnectionClosed):
        while True:
            await connection.send(await box.next())


def _sender(connection: ServerConnection) -> str:
    peer = connection.transport.get_extra_info("peername")
    return str(peer[0]) if peer else ""


def _response(status: int, body: bytes, headers: Mapping[str, str]) -> Response:
    more = {"content-length": str(len(body)), "connection": "close"}
    return Response(status, HTTPStatus(status).phrase, Headers({**headers, **more}), body)


@cache
def _page() -> bytes:
    """The page that shows the main face."""
    import numpy as np

    from elocute.export.html import live_page
    from elocute.head.builtin import load_builtin_head
    from elocute.motion.motion import Motion

    head = load_builtin_head()
    still = np.zeros((1, len(head.expression_names)), np.float32)
    turns = no_turn(1, len(head.joint_names))
    return "".join(live_page(Motion(head, still, 60.0, rotations=turns), "Elocute live")).encode()
