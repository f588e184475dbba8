"""`elocute live` with real sockets: what is sent, and when."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
import soundfile

import elocute
from elocute.export.arkit_csv import COLUMNS
from elocute.live.live_frame import LiveFrame
from tests.support.browser import eventually
from tests.support.commands import run_here

RATE = 16000


class Receiver:
    """A program that listens on a port of its own."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.2)
        self.port: int = self.socket.getsockname()[1]
        self.packets: list[bytes] = []
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._listen)
        self._thread.start()

    def _listen(self) -> None:
        while not self._ended.is_set():
            try:
                self.packets.append(self.socket.recv(65536))
            except TimeoutError:
                continue

    def records(self) -> list[dict]:
        """What was received, once no more comes."""
        self._ended.set()
        self._thread.join()
        self.socket.close()
        return [json.loads(packet) for packet in self.packets]


@pytest.fixture
def receiver() -> Iterator[Receiver]:
    made = Receiver()
    yield made
    made.records()


@pytest.fixture(scope="module")
def sound(speech_wav: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("live") / "words.wav"
    samples = elocute.read_audio(speech_wav, sample_rate=RATE).samples[:RATE]
    soundfile.write(path, samples, RATE, "PCM_16")
    return path


@pytest.fixture(scope="module")
def wanted(sound: Path) -> list[LiveFrame]:
    """The frames of that sound."""
    samples = elocute.read_audio(sound).samples
    stream = elocute.stream(RATE, lookahead=0.4)
    frames = [*stream.push(samples), *stream.flush()]
    return [LiveFrame(number, 60.0, frame) for number, frame in enumerate(frames)]


def check(records: list[dict], told: dict, wanted: list[LiveFrame]) -> None:
    """What was sent arrived, in order, as the stream gives it; a busy machine may drop some."""
    numbers = [record["frame"] for record in records]
    assert told["sent"] + told["dropped"] == len(wanted) == 60
    assert len(numbers) == told["sent"] > 0 and numbers == sorted(set(numbers))
    for record in records:
        curves = wanted[record["frame"]].arkit
        assert [record["curves"].get(name, 0) for name in COLUMNS] == pytest.approx(
            list(curves.values()), abs=2e-4
        )


def test_a_file_is_sent_at_its_own_pace(sound: Path, receiver: Receiver, wanted) -> None:
    to = ("--to", f"json=127.0.0.1:{receiver.port}", "--rate", RATE, "--lookahead", 0.4)
    done = run_here("live", sound, *to, "--json")
    assert done.returncode == 0, done.stderr
    assert f"sending to 127.0.0.1:{receiver.port}, 0.4 s late" in done.stderr
    check(receiver.records(), json.loads(done.stdout), wanted)


def test_standard_input_is_heard(sound: Path, receiver: Receiver, wanted) -> None:
    samples = soundfile.read(sound, dtype="int16")[0]
    command = ["-m", "elocute", "live", "-", "--to", f"json=:{receiver.port}", "--json"]
    done = subprocess.run(
        [sys.executable, *command, "--rate", str(RATE), "--lookahead", "0.4"],
        input=samples.astype("<i2").tobytes(),
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    check(receiver.records(), json.loads(done.stdout), wanted)


def test_nobody_needs_to_listen(sound: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    done = run_here("live", sound, "--to", f"vmc=127.0.0.1:{port}", "--rate", RATE)
    assert done.returncode == 0 and "frames sent" in done.stdout


def test_sound_comes_from_who_connects(sound: Path, receiver: Receiver, wanted) -> None:
    """A page and a program watch what a third says; a signal ends it."""
    pytest.importorskip("websockets")
    from tests.live.clients import connected, pcm

    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    to = ["--to", f"ws=:{port}", "--to", f"json=:{receiver.port}", "--lookahead", "0.4", "--json"]
    # A test before this one may have left the signal ignored, which a process inherits.
    heard = "import signal; signal.signal(signal.SIGTERM, signal.SIG_DFL); "
    code = heard + "from elocute.cli import main; main()"
    command = [sys.executable, "-c", code, "live", "ws", *to]
    with ExitStack() as stop:
        pipe = subprocess.PIPE
        run = stop.enter_context(subprocess.Popen(command, stdout=pipe, stderr=pipe))
        stop.callback(run.kill)
        assert run.stderr is not None
        told = run.stderr.readline().decode()
        assert f"http://127.0.0.1:{port}/" in told and "0.4 s late" in told
        with connected(port) as one:
            one.next()
            one.speak(pcm(elocute.read_audio(sound).samples), RATE)
            one.next()
            ended, frames = one.until("ended")
            assert ended["time_s"] == 1 and len(frames) >= 60
            assert eventually(lambda: len(receiver.packets) > 50)
        run.send_signal(signal.SIGTERM)
        out, err = run.communicate(timeout=60)
    assert run.returncode == 0 and err == b"", err
    record = json.loads(out)
    assert record["sent"] >= len(receiver.packets) > 50 and record["refused"] == 0
    for frame in map(json.loads, receiver.packets):
        if frame["frame"] >= 30:  # later ones know that silence follows
            break
        curves = wanted[frame["frame"]].arkit
        assert [frame["curves"].get(name, 0) for name in COLUMNS] == pytest.approx(
            list(curves.values()), abs=2e-3
        )


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--to", "unreal"), "--to unreal: unknown"),
        (("--to", "ws=0.0.0.0"), "--allow-remote sends to others"),
        (("--to", "json=192.0.2.1"), "--allow-remote sends to others"),
        (
            ("--to", "json", "--lookahead", "0.1"),
            "--lookahead: 0.1; allowed: exact, or 0.21 to 10 s",
        ),
    ],
)
def test_what_cannot_be_is_refused(sound: Path, arguments: tuple, told: str) -> None:
    done = run_here("live", sound, *arguments)
    assert done.returncode == 2 and told in done.stderr and done.stderr.count("\n") == 1


def test_sound_from_connections_needs_a_server() -> None:
    done = run_here("live", "ws", "--to", "json")
    assert (done.returncode == 2 and "found: no ws" in done.stderr) or "no ws" in done.stderr


def test_a_file_that_is_no_sound_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.wav").write_bytes(b"no sound")
    done = run_here("live", tmp_path / "a.wav", "--to", "json")
    assert done.returncode == 2 and "a.wav" in done.stderr


def test_a_microphone_that_is_not_there_is_told() -> None:
    try:
        import sounddevice

        if sounddevice.query_devices(kind="input"):
            pytest.skip("this machine has a microphone")
    except (ImportError, OSError, ValueError):
        pass
    done = run_here("live", "mic", "--to", "json")
    assert done.returncode in (1, 2) and done.stderr.count("\n") == 1
    assert "microphone" in done.stderr
