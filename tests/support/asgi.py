"""Asks an application as a server would, in this process: paths and fields go in as they are."""

from __future__ import annotations

import asyncio
import atexit
import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any


@dataclass(frozen=True)
class Answer:
    """What came back."""

    status: int
    fields: dict[str, str]
    data: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.data)


def asked(
    app: Any,
    method: str,
    path: str,
    *,
    body: bytes | Iterable[bytes] = b"",
    fields: Iterable[tuple[str, str]] = (),
    kind: str = "http",
) -> Answer:
    """One request; a body in pieces is sent as it comes, and has no length."""
    raw, _, query = path.partition("?")
    pieces = [body] if isinstance(body, bytes) else list(body)
    given = [(name.lower().encode(), value.encode("utf-8")) for name, value in fields]
    if isinstance(body, bytes) and body and "content-length" not in dict(fields):
        given.append((b"content-length", str(len(body)).encode()))
    scope = {
        "type": kind,
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": method,
        "scheme": "http",
        "path": _decoded(raw),
        "raw_path": raw.encode(),
        "query_string": query.encode(),
        "headers": given,
        "client": ("127.0.0.1", 1),
        "server": ("127.0.0.1", 80),
    }
    return _loop().run(_asked(app, scope, pieces))


@cache
def _loop() -> asyncio.Runner:
    """One for all requests, with its threads."""
    runner = asyncio.Runner()
    atexit.register(runner.close)
    return runner


async def _asked(app: Any, scope: dict[str, Any], pieces: list[bytes]) -> Answer:
    waiting = list(pieces)
    sent: list[dict[str, Any]] = []

    async def receive() -> dict[str, Any]:
        if scope["type"] == "websocket":
            return {"type": "websocket.connect"}
        if not waiting:
            await asyncio.Event().wait()  # who asks stays until the answer is there
        return {"type": "http.request", "body": waiting.pop(0), "more_body": bool(waiting)}

    async def send(message: dict[str, Any]) -> None:
        sent.append(message)

    await app(scope, receive, send)
    if scope["type"] == "websocket":
        closed = sent[0]["type"] == "websocket.close"
        return Answer(403 if closed else 101, {}, b"")
    begun = sent[0]
    fields = {name.decode().lower(): value.decode() for name, value in begun["headers"]}
    data = b"".join(each.get("body", b"") for each in sent[1:])
    return Answer(begun["status"], fields, data)


def _decoded(raw: str) -> str:
    """A path as servers give it: decoded once."""
    from urllib.parse import unquote

    return unquote(raw)
