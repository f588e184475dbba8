"""The WebSocket of `elocute live` with real connections: what comes back, and what is refused."""

from __future__ import annotations

import asyncio
import json
import struct
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from email.message import Message
from http.client import HTTPConnection
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("websockets")

from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

import elocute
from elocute.errors import OutputError
from elocute.live import faces
from elocute.live.faces import Face, Outbox
from elocute.live.live_frame import LiveFrame
from elocute.live.protocol import Watch
from elocute.live.targets import Access, open_outputs
from elocute.live.ws_server import FAULTS_MAX, VOICES, LiveServer
from elocute.models.streaming import Stream
from tests.live.clients import Client, client, pcm
from tests.support.browser import eventually

RATE, LOOKAHEAD_S = 16000, 0.3


def open_stream(rate: int) -> Stream:
    return elocute.stream(rate, lookahead=LOOKAHEAD_S)


@pytest.fixture
def server() -> Iterator[LiveServer]:
    with ExitStack() as opened:
        made = LiveServer(("127.0.0.1", 0), Access())
        opened.callback(made.close)
        made.hear(open_stream)
        yield made


@pytest.fixture(scope="module")
def words(speech_wav) -> np.ndarray:
    """A second and a half of speech, as 16-bit integers."""
    return pcm(elocute.read_audio(speech_wav, sample_rate=RATE).samples[:24000])


@pytest.fixture(scope="module")
def wanted(words) -> list[LiveFrame]:
    """Its frames, and some of the silence after it."""
    stream = open_stream(RATE)
    sound = np.concatenate([words, np.zeros(RATE // 2, np.int16)]).astype(np.float32) / 32768
    return [LiveFrame(number, 60.0, frame) for number, frame in enumerate(stream.push(sound))]


def check(frames: list[dict], wanted: list[LiveFrame], first_s: float = 0.0) -> None:
    """Frames of JSON are those of the stream, each once and in order."""
    for record, frame in zip(frames, wanted, strict=False):
        assert record["time_s"] == pytest.approx(first_s + frame.frame.time_s, abs=1e-4)
        given = [record["curves"].get(name, 0) for name in frame.arkit]
        assert given == pytest.approx(list(frame.arkit.values()), abs=2e-4)


def test_sound_that_is_sent_comes_back_as_the_frames_of_a_stream(server, words, wanted):
    with client(server) as one:
        assert one.next()["curves"] == list(wanted[0].arkit)
        one.speak(words, RATE)
        assert one.next() == {"type": "started", "time_s": 0.0}
        ended, frames = one.until("ended")
        assert ended["time_s"] == 1.5 and len(frames) >= 90  # all that the sound has, at once
        check(frames, wanted)
        assert max(record["curves"].get("jawOpen", 0) for record in frames) > 0.1


def test_stereo_in_odd_pieces_is_the_same(server, words, wanted):
    with client(server) as one:
        one.next()
        one.tell("start", rate=RATE, channels=2)
        data = np.stack([words, words], axis=1).astype("<i2").tobytes()
        for at in range(0, len(data), 3333):
            one.connection.send(data[at : at + 3333])
        one.tell("end")
        one.next()
        check(one.until("ended")[1], wanted)


def test_a_binary_frame_holds_curves_and_turns(server, words, wanted):
    watch = {"format": "binary", "shapes": "elocute"}
    with client(server, watch=watch) as one:
        names = one.next()
        one.speak(words, RATE)
        one.next()
        data = [one.connection.recv(timeout=60) for _ in range(60)]
    assert names["curves"] == list(wanted[0].frame.names)
    for number, (each, frame) in enumerate(zip(data, wanted, strict=False)):
        assert isinstance(each, bytes)
        assert struct.unpack("<IId", each[:16])[:2] == (number, len(names["curves"]))
        numbers = np.frombuffer(each[16:], "<f4")
        values, turns = np.split(numbers, [len(names["curves"])])
        assert np.abs(values - frame.frame.values).max() < 1e-4
        w, x, y, z = frame.joint("head")
        head = names["joints"].index("head")
        assert turns.reshape(-1, 4)[head] == pytest.approx([x, y, z, w], abs=1e-5)


def test_expressions_of_vrm_are_sent_where_they_are_wanted(server, words, wanted):
    with client(server, watch={"format": "json", "shapes": "vrm"}) as one:
        assert {"aa", "ih", "ou", "ee", "oh", "blink"} <= set(one.next()["curves"])
        one.speak(words[:8000], RATE)
        one.next()
        frames = one.until("ended")[1]
    assert frames[20]["curves"].get("aa", 0) == pytest.approx(wanted[20].vrm["aa"], abs=1e-3)


def test_a_face_lives_on_between_two_sounds(server, words):
    with client(server) as one:
        one.next()
        one.speak(words[:8000], RATE)
        one.next()
        one.until("ended")
        frames = [one.next() for _ in range(40)]  # silence, while nothing is sent
        one.speak(words[:8000], RATE)
        started, more = one.until("started")
        _, spoken = one.until("ended")
    times = [frame["time_s"] for frame in [*frames, *more, *spoken]]
    assert np.diff(times) == pytest.approx(1 / 60, abs=2e-4)
    assert started["time_s"] > 0.5 and spoken[-1]["time_s"] > started["time_s"] + 0.45


def test_an_interruption_voids_what_was_said(server, words):
    with client(server) as one:
        one.next()
        one.tell("start", rate=RATE)
        one.connection.send(np.tile(words, 20).astype("<i2").tobytes())  # half a minute
        one.next()
        one.tell("interrupt")
        interrupted, _ = one.until("interrupted")
        assert interrupted["time_s"] < 25  # most of it was never animated
        after = [one.next() for _ in range(60)]
        assert after[0]["time_s"] >= interrupted["time_s"] - 1e-3
        assert after[-1]["curves"].get("jawOpen", 0) < 0.02  # at rest a second later
        one.speak(words[:8000], RATE)
        assert one.until("started")[0]["time_s"] >= interrupted["time_s"]


def test_many_watch_and_one_speaks(server, words, wanted):
    with client(server) as one, client(server) as two, client(server, watch=None) as three:
        one.next()
        two.next()
        assert three.next() == {"type": "welcome", "version": 1}
        three.speak(words[:8000], RATE)
        for each in (one, two):
            each.next()
            check(each.until("ended")[1], wanted[:20])
        one.tell("start", rate=RATE)
        refused = one.until("error")[0]
        assert "a face that another moves" in refused["message"]


def test_faces_are_apart(server, words, wanted):
    with client(server, face="anna") as anna, client(server, face="bert") as bert:
        anna.next()
        bert.next()
        anna.speak(words[:8000], RATE)
        bert.speak(words[8000:16000], RATE)
        for each in (anna, bert):
            assert each.next()["time_s"] == 0
        check(anna.until("ended")[1], wanted[:20])
        assert eventually(lambda: len(server._faces) == 3)
    assert eventually(lambda: len(server._faces) == 1)


def test_a_face_can_be_taken_over_by_who_comes_next(server, words):
    with client(server) as one:
        one.next()
        one.tell("start", rate=RATE)
        one.connection.send(words.tobytes())
        one.next()
    with client(server) as two:
        two.next()
        two.speak(words[:8000], RATE)
        two.until("started")


def test_voices_are_limited(server):
    with ExitStack() as opened:
        for number in range(VOICES + 1):
            made = opened.enter_context(client(server, face=f"face{number}"))
            made.next()
            made.tell("start", rate=RATE)
            said = made.next()
            assert (said["type"] == "error") == (number == VOICES)


MALFORMED = [
    ("nonsense", "no JSON"),
    ("[1]", "list"),
    ('{"type": "start"}', "`rate`"),
    ('{"type": "start", "rate": 1e9}', "`rate`"),
    ('{"type": "start", "rate": 7999}', "8000 to 192000"),
    ('{"type": "start", "rate": 16000, "channels": 0}', "`channels`"),
    ('{"type": "start", "rate": 16000, "format": "f32"}', "'format'"),
    ('{"type": "listen", "on": 1}', "true or false"),
    ('{"type": "begin"}', "start, listen, interrupt, end"),
    ('{"type": ["start"]}', "start, listen, interrupt, end"),
    ('{"rate": 16000}', "no `type`"),
    ('{"type": "end"}', "before `start`"),
    (b"\0\0", "before `start`"),
    ('{"type": "end", "more": "' + "x" * 5000 + '"}', "letters"),
    ("[" * 3000, "message"),
    ('{"type": NaN}', "message"),
]


def test_what_is_malformed_is_answered_and_the_connection_goes_on(server, words, wanted):
    with client(server) as one:
        one.next()
        for text, why in MALFORMED:
            one.connection.send(text)
            said = one.next()
            assert (said["type"], said["error"]) == ("error", "refused")
            assert why in said["message"] and "\n" not in said["message"]
        one.speak(words[:8000], RATE)
        one.next()
        check(one.until("ended")[1], wanted[:20])


def test_who_sends_nothing_else_is_closed(server):
    with client(server) as one:
        one.next()
        with pytest.raises(ConnectionClosed) as closed:
            for _ in range(FAULTS_MAX + 2):
                one.connection.send("nonsense")
                one.next()
            one.next()
        assert closed.value.rcvd and closed.value.rcvd.code == 1008


@pytest.mark.parametrize(
    ("hello", "why"),
    [
        ({"version": 2}, "`version`: 2; allowed: 1"),
        ({"type": "start"}, "allowed: hello"),
        ({"face": "../x"}, "`face`"),
        ({"watch": {"format": "xml"}}, "allowed: json, binary"),
        ({"watch": {"format": ["json"]}}, "allowed: json, binary"),
        ({"watch": {"shapes": "flame"}}, "allowed: arkit, vrm, elocute"),
        ({"watch": "json"}, "`watch`"),
    ],
)
def test_another_hello_is_refused(server, hello, why):
    with client(server, **hello) as one:
        assert why in one.next()["message"]
        with pytest.raises(ConnectionClosed):
            one.next()


def test_a_server_with_its_own_source_takes_no_sound(words):
    server = LiveServer(("127.0.0.1", 0), Access())
    try:
        with client(server) as one:
            one.next()
            one.tell("start", rate=RATE)
            assert "a face with a source of its own" in one.next()["message"]
    finally:
        server.close()


def test_who_is_slow_loses_frames_and_is_told(wanted, monkeypatch):
    monkeypatch.setattr(faces, "FRAMES_MAX", 10)

    async def received() -> list[str]:
        face, box = Face(asyncio.get_running_loop()), Outbox(Watch("json", "arkit"))
        face.enter(box)
        for frame in wanted[:25]:
            face.send(frame)
        face.tell("last")
        await asyncio.sleep(0)
        taken = []
        while not taken or taken[-1] != "last":
            taken.append(str(await box.next()))
        face.leave(box)
        assert face.failures == 20
        return taken

    taken = asyncio.run(received())
    dropped = [json.loads(text) for text in taken if "dropped" in text]
    assert dropped == [{"type": "dropped", "frames": 10}] * 2
    numbers = [json.loads(text)["frame"] for text in taken if '"frame":' in text]
    assert numbers == [20, 21, 22, 23, 24]  # the newest


def opened(server: LiveServer, **headers: str) -> None:
    with connect(f"ws://127.0.0.1:{server.port}/live", additional_headers=headers):
        pass


def test_pages_of_other_servers_are_kept_out(server):
    own, other = f"http://127.0.0.1:{server.port}", "http://studio.example"
    opened(server, Origin=own)
    for origin in (other, "null", "http://127.0.0.1:1"):
        with pytest.raises(InvalidStatus) as refused:
            opened(server, Origin=origin)
        assert refused.value.response.status_code == 403
    guest = LiveServer(("127.0.0.1", 0), Access(origins=(other,)))
    try:
        opened(guest, **{"Origin": other, "Sec-Fetch-Site": "cross-site"})
    finally:
        guest.close()


@dataclass(frozen=True)
class Answer:
    status: int
    headers: Message
    body: bytes


def asked(server: LiveServer, path: str, **headers: str) -> Answer:
    connection = HTTPConnection("127.0.0.1", server.port, timeout=60)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return Answer(answer.status, answer.headers, body)


def test_a_name_that_was_turned_to_this_machine_is_kept_out(server):
    assert asked(server, "/", Host="studio.example").status == 421
    assert asked(server, "/", Host=f"localhost:{server.port}").status == 200


def test_where_others_are_let_in_any_address_in_numbers_is_its_own():
    server = LiveServer(("127.0.0.1", 0), Access(allow_remote=True, token="of sixteen letters"))
    try:
        for host, status in (("192.0.2.7:9872", 200), ("[2001:db8::7]", 200), ("a.example", 421)):
            assert asked(server, "/", Host=host).status == status
    finally:
        server.close()


def test_the_page_is_served_and_nothing_else(server):
    page = asked(server, "/")
    policy = page.headers["content-security-policy"]
    assert page.status == 200 and b'<script id="head"' in page.body
    assert "default-src 'none'" in policy and "connect-src 'self'" in policy
    assert page.headers["x-frame-options"] == "DENY"
    assert asked(server, "/../etc/passwd").status == 404
    assert asked(server, "/live").status == 426  # no WebSocket


def test_a_token_is_asked_for():
    server = LiveServer(("127.0.0.1", 0), Access(token="of sixteen letters"))
    try:
        assert server.address.endswith("#token=of sixteen letters")
        for token, kind in (
            ("another", "error"),
            (None, "error"),
            ("of sixteen letters", "welcome"),
        ):
            with client(server, token=token) as one:
                assert one.next()["type"] == kind
    finally:
        server.close()


class Taker:
    """A target that keeps what it is sent."""

    address, has_clock, failures = "here", False, 0

    def __init__(self) -> None:
        self.frames: list[LiveFrame] = []

    def send(self, frame: LiveFrame) -> None:
        self.frames.append(frame)

    def close(self) -> None: ...


def test_frames_go_to_other_targets_as_well(server, words, wanted):
    taker = Taker()
    server.hear(open_stream, [server, taker])
    with client(server) as one:
        one.next()
        one.speak(words[:8000], RATE)
        one.next()
        one.until("ended")
        assert eventually(lambda: len(taker.frames) > 12)
    for frame in taker.frames:  # a busy machine may drop some
        if frame.number >= 12:  # the sound goes on otherwise
            break
        same = wanted[frame.number]
        assert frame.frame.time_s == same.frame.time_s
        assert list(frame.arkit.values()) == pytest.approx(list(same.arkit.values()), abs=2e-4)


def test_an_interruption_reaches_the_other_targets_without_a_jump(server, words):
    taker = Taker()
    server.hear(open_stream, [taker])
    with client(server) as one:
        one.next()
        one.tell("start", rate=RATE)
        one.connection.send(np.tile(words, 8).astype("<i2").tobytes())  # twelve seconds at once
        assert eventually(lambda: len(taker.frames) > 20)
        one.tell("interrupt")
        one.until("started")
        rest_s = one.until("interrupted")[0]["time_s"] + 0.15
        assert eventually(lambda: taker.frames[-1].frame.time_s > rest_s + 0.8)
    after = [each for each in taker.frames if each.frame.time_s > rest_s - 0.15]
    jaw = [(f.frame.time_s - rest_s, f.arkit["jawOpen"]) for f in after]
    assert max(value for late_s, value in jaw if late_s > 0) < 0.05  # as good as shut
    assert max(value for late_s, value in jaw if late_s > 0.5) < 0.02
    for one_frame, next_frame in pairwise(after):  # a busy machine may drop some
        if next_frame.number == one_frame.number + 1:
            assert abs(next_frame.arkit["jawOpen"] - one_frame.arkit["jawOpen"]) < 0.1


def test_a_port_that_is_taken_is_told(server):
    with pytest.raises(OutputError, match=f"127.0.0.1:{server.port}: cannot be listened on"):
        open_outputs([f"ws=127.0.0.1:{server.port}"])


def test_closing_ends_every_connection(words):
    server = LiveServer(("127.0.0.1", 0), Access())
    server.hear(open_stream)
    with client(server) as one:
        one.next()
        one.tell("start", rate=RATE)
        one.next()
        server.close()
        with pytest.raises(ConnectionClosed):
            Client(one.connection).until("nothing")
