"""What stands before a server of pages: who may ask, for what, how often and how much.

A request passes only if its address is one of a fixed list as it was sent, not decoded, and without
a query but where one is named; its Host is the server's own, and so is its Origin where it has one;
its body is no larger than such a body may be, which is known before it is read; and neither its
sender nor its token asks too often. Every answer carries the headers that keep a page to itself.
"""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from dataclasses import dataclass
from typing import Any

from elocute.serving.gate import HEADERS, Fields, Gate, Rates, fields_of

BODY_MAX_BYTES = 4_096
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]
Refusal = tuple[int, str]
"""Status and reason."""
JSON_TYPES = ("application/json", "application/json;charset=utf-8")
WAYS = {"http": "GET", "websocket": "WS"}


@dataclass(frozen=True)
class Body:
    """What a request may bring: how many bytes, and of which kinds; () is any.

    `whole`: whether it is read before it is answered. Else it is counted as it comes.
    """

    max_bytes: int = BODY_MAX_BYTES
    types: tuple[str, ...] = JSON_TYPES
    whole: bool = True


SMALL = Body()


class Guard:
    """An ASGI application before another one.

    Parameters
    ----------
    app : ASGI application
        What answers.
    hosts : frozenset of str
        Allowed values of Host, from `host_names`.
    paths : mapping of str to pattern
        The methods allowed, and what addresses each may ask for; "WS" is a WebSocket.
    senders : Rates
        For each address that requests come from.
    bodies : mapping of pattern to Body
        What may be sent to an address; `SMALL` to all others.
    queries : pattern
        Addresses of "GET" and "POST" that may have a query.
    knows : callable, optional
        Takes the sender, the headers and the query of a request, and gives why it is refused, None
        where it is not.
    numeric : bool
        As `Gate` takes it.
    """

    def __init__(
        self,
        app: App,
        hosts: frozenset[str],
        paths: Mapping[str, re.Pattern[bytes]],
        senders: Rates,
        *,
        bodies: Mapping[re.Pattern[bytes], Body] | None = None,
        queries: re.Pattern[bytes] = re.compile(b"/"),
        knows: Callable[[str, Fields, bytes], Refusal | None] | None = None,
        numeric: bool = False,
    ) -> None:
        self._app, self._paths = app, paths
        self._gate = Gate(hosts, senders, numeric=numeric)
        self._bodies, self._queries, self._knows = bodies or {}, queries, knows

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Answer one request, or refuse it."""
        if scope["type"] not in WAYS:
            return
        if scope["type"] == "websocket":
            if self._refusal(scope, "WS") is None:
                await self._app(scope, receive, send)
            else:
                await receive()
                await send({"type": "websocket.close", "code": 1008})
            return
        with_headers = _Headers(send)
        method = str(scope["method"])
        refusal = self._refusal(scope, method)
        if refusal is None and method not in ("GET", "HEAD"):
            body = self._body_of(scope)
            refusal = _body_refusal(method, body, fields_of(scope["headers"]))
            if refusal is None and body.whole:
                data = await _body(receive, body.max_bytes)
                refusal = (413, "large") if data is None else None
                receive = _again(data or b"", receive)
            elif refusal is None:
                receive = _counted(receive, body.max_bytes)
        if refusal is not None:
            await _refuse(with_headers, *refusal)
            return
        await self._app(scope, receive, with_headers)

    def _refusal(self, scope: Message, method: str) -> Refusal | None:
        """Status and reason, None where the request may pass."""
        fields = fields_of(scope["headers"])
        client = scope.get("client")
        sender = str(client[0]) if client else ""
        path, query = _bytes(scope, "raw_path"), _bytes(scope, "query_string")
        refusal = self._gate.refusal(sender, fields, is_page=(method, path) == ("GET", b"/"))
        if refusal is not None:
            return refusal
        allowed = self._paths.get(method)
        if allowed is None:
            return 405, "method"
        # Panels, mail and networks add what they like to a link.
        if not allowed.fullmatch(path) or (query and not self._takes_query(method, path)):
            return 404, "unknown"
        return None if self._knows is None else self._knows(sender, fields, query)

    def _takes_query(self, method: str, path: bytes) -> bool:
        return method in ("GET", "POST") and self._queries.fullmatch(path) is not None

    def _body_of(self, scope: Message) -> Body:
        path = _bytes(scope, "raw_path")
        return next((body for to, body in self._bodies.items() if to.fullmatch(path)), SMALL)


def _bytes(scope: Message, name: str) -> bytes:
    value = scope.get(name)
    return value if isinstance(value, bytes) else b""


def _body_refusal(method: str, body: Body, fields: Fields) -> Refusal | None:
    kind = fields.get("content-type", [])
    if (
        method != "DELETE"
        and body.types
        and (len(kind) != 1 or kind[0].lower().replace(" ", "") not in body.types)
    ):
        return 415, "type"
    length = fields.get("content-length", ["0"])
    if len(length) != 1 or not re.fullmatch(r"\d{1,12}", length[0]):
        return 400, "length"
    if int(length[0]) > body.max_bytes:
        return 413, "large"
    return None


async def _body(receive: Receive, most: int) -> bytes | None:
    """A whole body, None where it is too large."""
    body = bytearray()
    while True:
        message = await receive()
        if message["type"] != "http.request":
            return bytes(body)
        body += _bytes(message, "body")
        if len(body) > most:
            return None
        if not message.get("more_body"):
            return bytes(body)


def _counted(receive: Receive, most: int) -> Receive:
    """A body as it comes; where it is larger than was said, its sender is as good as gone."""
    count = 0

    async def given() -> Message:
        nonlocal count
        message = await receive()
        count += len(_bytes(message, "body"))
        return message if count <= most else {"type": "http.disconnect"}

    return given


def _again(body: bytes, receive: Receive) -> Receive:
    """The body once more, for who asks next."""
    waiting: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]

    async def given() -> Message:
        return waiting.pop() if waiting else await receive()

    return given


class _Headers:
    """Sends what is sent, with the headers of every answer."""

    def __init__(self, send: Send) -> None:
        self._send = send

    async def __call__(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            known = list(message.get("headers", []))
            named = {name.lower() for name, _ in known}
            known += [
                (name.encode(), value.encode())
                for name, value in HEADERS.items()
                if name.encode() not in named
            ]
            if b"cache-control" not in named:
                known.append((b"cache-control", b"no-store"))
            message = {**message, "headers": known}
        await self._send(message)


async def _refuse(send: Send, status: int, reason: str) -> None:
    body = b'{"error": "%s"}' % reason.encode()
    headers = [
        (b"content-type", b"application/json"),
        (b"content-length", str(len(body)).encode()),
        (b"connection", b"close"),
    ]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
