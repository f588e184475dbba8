"""Sockets that wait for connections, and how many there may be at once."""

from __future__ import annotations

import contextlib
import socket
from collections import Counter
from typing import Protocol

from elocute.errors import OutputError

MOST = 2_000
SPARE = 400
"""Descriptors for the database, what was accepted a moment ago, and Python itself."""
EACH = 2
"""Descriptors of a connection: its own, and that of the video that it is given."""


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
