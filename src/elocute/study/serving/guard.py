"""What stands before the study's server: who may ask, for what, how often and how much.

A request passes only if its address is one of a fixed list as it was sent, not decoded, and without
a query but for the first page's, which the server does not read; its Host is the server's own, and
so is its Origin where it has one; its body is small; and neither its sender nor its token asks too
often. Every answer carries the headers that keep the page to itself.
"""

from __future__ import annotations

import re
import threading
import time
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from typing import Any

BODY_MAX_BYTES = 4_096
SENDERS_MAX = 20_000
"""Senders and tokens whose rates are remembered; the oldest are forgotten."""
HEADERS = {
    "content-security-policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "connect-src 'self'; media-src blob:; img-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=(), interest-cohort=()",
    "x-robots-tag": "noindex",
}
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]


class Rates:
    """How often each sender may ask: so many at once, and so many a second.

    Parameters
    ----------
    burst : float
        At once.
    each_s : float
        More in each second.
    clock : callable
        Seconds.
    """

    def __init__(
        self, burst: float, each_s: float, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._burst, self._each_s, self._clock = burst, each_s, clock
        self._left: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def allows(self, sender: str) -> bool:
        """Count one more of a sender; whether it may pass."""
        now = self._clock()
        left, at = self._left.pop(sender, (self._burst, now))
        left = min(self._burst, left + (now - at) * self._each_s)
        allowed = left >= 1
        self._left[sender] = (left - 1 if allowed else left, now)
        if len(self._left) > SENDERS_MAX:
            self._left.popitem(last=False)
        return allowed


class SteadyClock:
    """Seconds since 1970 that never go back, though the machine's clock may be set back.

    What it is asked for is how long somebody watched, and a time that is written beside an answer.
    """

    def __init__(self, wall: Callable[[], float] = time.time) -> None:
        self._wall, self._lock = wall, threading.Lock()
        self._last, self._at = wall(), time.monotonic()

    def __call__(self) -> float:
        """The time now: the machine's, or what has passed since the last one that was later."""
        with self._lock:
            at = time.monotonic()
            self._last = max(self._wall(), self._last + at - self._at)
            self._at = at
            return self._last


def host_names(hosts: Iterable[str], port: int) -> frozenset[str]:
    """What a Host header may be, of names with a port or without, in small letters.

    Each with its own port, or with the one on which the server listens, or without any.
    """
    allowed: set[str] = set()
    for host in hosts:
        name = host.lower()
        allowed.add(name)
        if not re.search(r":\d+$", name) or name.endswith("]"):
            allowed.add(f"{name}:{port}")
    return frozenset(allowed)


class Guard:
    """An ASGI application before another one.

    Parameters
    ----------
    app : ASGI application
        What answers.
    hosts : frozenset of str
        Allowed values of Host, from `host_names`.
    paths : dict of str to pattern
        The methods allowed, "GET" or "POST", and what addresses each may ask for.
    senders : Rates
        For each address that requests come from.
    """

    def __init__(
        self,
        app: App,
        hosts: frozenset[str],
        paths: dict[str, re.Pattern[bytes]],
        senders: Rates,
    ) -> None:
        self._app, self._hosts, self._paths, self._senders = app, hosts, paths, senders
        self._origins = {f"{scheme}://{host}" for scheme in ("http", "https") for host in hosts}

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Answer one request, or refuse it."""
        if scope["type"] != "http":
            return
        with_headers = _Headers(send)
        refusal = self._refusal(scope)
        if refusal is None and scope["method"] == "POST":
            body = await _body(receive)
            refusal = (413, "large") if body is None else None
            receive = _again(body or b"", receive)
        if refusal is not None:
            await _refuse(with_headers, *refusal)
            return
        await self._app(scope, receive, with_headers)

    def _refusal(self, scope: Message) -> tuple[int, str] | None:
        """Status and reason, None where the request may pass."""
        fields: dict[str, list[str]] = {}
        for name, value in scope["headers"]:
            fields.setdefault(name.decode("latin-1"), []).append(value.decode("latin-1"))
        client = scope.get("client")
        if not self._senders.allows(client[0] if client else ""):
            return 429, "often"
        host = fields.get("host", [])
        if len(host) != 1 or host[0].lower() not in self._hosts:
            return 421, "host"
        if any(origin.lower() not in self._origins for origin in fields.get("origin", [])):
            return 403, "origin"
        site = fields.get("sec-fetch-site", ["none"])
        if any(each not in ("same-origin", "none") for each in site) and not self._is_visit(
            scope, fields
        ):
            return 403, "origin"
        allowed = self._paths.get(scope["method"])
        if allowed is None:
            return 405, "method"
        path, query = scope.get("raw_path") or b"", scope.get("query_string") or b""
        if not allowed.fullmatch(path) or (query and (scope["method"], path) != ("GET", b"/")):
            return 404, "unknown"  # panels, mail and networks add what they like to a link
        if scope["method"] == "POST":
            return _post_refusal(fields)
        return None

    @staticmethod
    def _is_visit(scope: Message, fields: dict[str, list[str]]) -> bool:
        """Somebody who follows a link of another page to the first page."""
        return (
            scope["method"] == "GET"
            and scope.get("raw_path") == b"/"
            and fields.get("sec-fetch-mode") == ["navigate"]
            and fields.get("sec-fetch-dest") == ["document"]
        )


def _post_refusal(fields: dict[str, list[str]]) -> tuple[int, str] | None:
    kind = fields.get("content-type", [])
    if len(kind) != 1 or kind[0].lower().replace(" ", "") not in (
        "application/json",
        "application/json;charset=utf-8",
    ):
        return 415, "type"
    length = fields.get("content-length", ["0"])
    if len(length) != 1 or not re.fullmatch(r"\d{1,9}", length[0]):
        return 400, "length"
    if int(length[0]) > BODY_MAX_BYTES:
        return 413, "large"
    return None


async def _body(receive: Receive) -> bytes | None:
    """A whole body, None where it is too large."""
    body = b""
    while True:
        message = await receive()
        if message["type"] != "http.request":
            return body
        body += message.get("body", b"")
        if len(body) > BODY_MAX_BYTES:
            return None
        if not message.get("more_body"):
            return body


def _again(body: bytes, receive: Receive) -> Receive:
    """The body once more, for who asks next."""
    waiting = [{"type": "http.request", "body": body, "more_body": False}]

    async def given() -> Message:
        return waiting.pop() if waiting else await receive()

    return given


class _Headers:
    """Sends what is sent, with the headers of every answer."""

    def __init__(self, send: Send) -> None:
        self._send = send

    async def __call__(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            known = [(name, value) for name, value in message.get("headers", [])]
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
