"""Half-open requests: they end by themselves, and never keep others out."""

import resource
import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import pytest

pytest.importorskip("uvicorn")

import uvicorn

from elocute.serving import connections
from elocute.serving.connections import bounded
from elocute.serving.listening import MOST, Room, connection_limit
from tests.study.studies import Asker, served
from tests.support.browser import eventually
from tests.support.commands import TIMEOUT_S


async def hello(scope, receive, send):
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"hello"})


@contextmanager
def answering(room: Room) -> Iterator[int]:
    """A server in a thread; gives its port."""
    opened = socket.create_server(("127.0.0.1", 0))
    config = uvicorn.Config(hello, http=bounded(room), lifespan="off", log_level="error")
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [opened]})
    thread.start()
    try:
        yield opened.getsockname()[1]
    finally:
        server.should_exit = True
        thread.join(TIMEOUT_S)


def half_open(port: int, sent: bytes = b"GET / HTTP/1.1\r\nHost: a\r\nX: ") -> socket.socket:
    made = socket.create_connection(("127.0.0.1", port), timeout=TIMEOUT_S)
    made.sendall(sent)
    return made


def ended(waiting: socket.socket, more: bytes = b"") -> bool:
    """Whether the server has closed it, also where it is sent something more."""
    waiting.settimeout(0.05)
    try:
        waiting.sendall(more)
        return waiting.recv(1_000) == b""
    except TimeoutError:
        return False
    except (ConnectionResetError, BrokenPipeError):
        return True


@pytest.mark.parametrize(
    ("sent", "more"),
    [
        (b"", b""),
        (b"GET / HT", b""),
        (b"GET / HTTP/1.1\r\nHost: a\r\nX: ", b"a"),  # a byte now and then does not prolong it
        (b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 9\r\n\r\n1", b""),
    ],
)
def test_a_request_that_does_not_end_is_ended(monkeypatch, sent, more):
    monkeypatch.setattr(connections, "WHOLE_S", 0.3)
    with answering(Room(10, 10)) as port, half_open(port, sent) as waiting:
        assert eventually(lambda: ended(waiting, more))


def test_the_longest_waiting_makes_place_for_a_new_one(monkeypatch):
    monkeypatch.setattr(connections, "WHOLE_S", 3600.0)
    with answering(Room(10, 4)) as port, ExitStack() as opened:
        waiting = [opened.enter_context(half_open(port)) for _ in range(12)]
        whole = opened.enter_context(half_open(port, b"GET / HTTP/1.1\r\nHost: a\r\n\r\n"))
        assert whole.recv(1_000).startswith(b"HTTP/1.1 200")
        assert eventually(lambda: ended(waiting[0]))


def test_no_one_of_a_room_is_counted_twice():
    room = Room(3, 2)
    ended = []

    class Someone:
        def __init__(self, address: str) -> None:
            self.address, self.counted = address, True

        def end(self):
            ended.append(self)
            room.leave(self)
            room.leave(self)

    a, b, c, d, e = (Someone(address) for address in "aaabc")
    for each in (a, b, c):
        room.enter(each)
    assert ended == [a]  # three of one address
    room.waits(b, False)  # its request is whole
    room.enter(d)
    room.enter(e)
    assert ended == [a, c]  # four in all: of those who wait, the first


def test_there_are_fewer_connections_than_descriptors(monkeypatch):
    allowed = [(1024, 1024)]
    monkeypatch.setattr(resource, "getrlimit", lambda _: allowed[0])
    monkeypatch.setattr(resource, "setrlimit", lambda _, limits: allowed.append(limits))
    assert 2 * connection_limit() + 400 <= 1024
    allowed[0] = (1024, 1_000_000)
    assert connection_limit() == MOST and allowed[-1] == (4_400, 1_000_000)


def test_half_open_requests_do_not_end_the_service(flashes, tmp_path):
    def limited():
        resource.setrlimit(resource.RLIMIT_NOFILE, (520, 520))

    database = f"sqlite:///{tmp_path}/a.db"
    with served(flashes, "--database", database, preexec_fn=limited) as host, ExitStack() as held:
        port = int(host.rpartition(":")[2])
        for _ in range(300):
            held.enter_context(half_open(port))
        asker = Asker(host)
        assert asker.join()["state"] == "trial"
        asker.close()
