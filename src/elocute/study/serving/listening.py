"""Waiting for requests: the one place of the package that others may connect to."""

from __future__ import annotations

import socket
from typing import Any

from elocute.errors import OutputError


def listening(address: str, port: int) -> socket.socket:
    """A socket that takes connections.

    Parameters
    ----------
    address : str
        Of this machine.
    port : int
        0 takes a free one.

    Returns
    -------
    socket.socket

    Raises
    ------
    OutputError
        For an address or port that cannot be had.
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
    """Answer until the process is told to end.

    Parameters
    ----------
    app : ASGI application
        From `study_app`.
    opened : socket.socket
        From `listening`; it is closed in the end.
    behind_proxy : bool
        Whether a server on this machine passes requests on, and says who asks.
    """
    import uvicorn

    from elocute.study.serving.connections import (
        ADDRESS_SHARE,
        BACKLOG,
        Room,
        bounded,
        connection_limit,
    )

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
