"""`elocute studio` as a process: the link, its socket, and what is left when it is killed."""

from __future__ import annotations

import contextlib
import json
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("fastapi")

from elocute.studio import Project
from tests.study.studies import Asker
from tests.support.browser import eventually
from tests.support.commands import SAME_ELOCUTE, TIMEOUT_S, run_here


@pytest.fixture
def room(tmp_path: Path, speech_wav: Path) -> Path:
    folder = tmp_path / "takes"
    folder.mkdir()
    (folder / "line.flac").write_bytes(speech_wav.read_bytes())
    Project(folder, "line.flac").save(folder / "line.elocute.json")
    return folder


@contextlib.contextmanager
def served(place: Path) -> Iterator[tuple[subprocess.Popen[str], str, str]]:
    """A studio in a process of its own: the process, its host with the port, and its token."""
    words = [sys.executable, "-m", "elocute", "studio", str(place), "--port", "0", "--no-open"]
    running = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=SAME_ELOCUTE
    )
    try:
        assert running.stdout is not None and running.stderr is not None
        line = running.stdout.readline()
        found = re.search(r"http://([0-9.:]+)/\?token=(\S+) \(Ctrl-C ends\)", line)
        assert found, (line, running.stderr.read())
        yield running, found[1], found[2]
    finally:
        running.send_signal(signal.SIGTERM)
        running.communicate(timeout=TIMEOUT_S)


def hidden(folder: Path) -> list[str]:
    return [each.name for each in folder.iterdir() if each.name.startswith(".")]


def test_a_killed_studio_loses_nothing_that_was_answered(room: Path, unmeasured):
    from websockets.sync.client import connect

    with served(room / "line.elocute.json") as (running, host, token):
        asker = Asker(host)
        assert asker.send("GET", "/api/projects")[0] == 403
        known = {"Authorization": f"Bearer {token}", "Content-Type": "application/json"}
        _, fields, data = asker.send("GET", "/api/projects/line", None, known)
        told = {"Cookie": f"elocute_studio_{host.split(':')[1]}={token}"}
        with connect(f"ws://{host}/api/events", additional_headers=told) as events:
            record = json.loads(data) | {"locks": {"kept": True}}
            saving = known | {"If-Match": fields["etag"]}
            body = json.dumps(record).encode()
            assert asker.send("PUT", "/api/projects/line", body, saving)[0] == 200
            heard = {"what": ""}
            while heard["what"] != "project":  # its workers are told of before
                heard = json.loads(events.recv(TIMEOUT_S))
            assert heard["project"] == "line"
            running.kill()
            running.wait(TIMEOUT_S)
        assert json.loads((room / "line.elocute.json").read_text())["locks"] == {"kept": True}
        assert hidden(room)
        asker.close()
    with served(room) as (_, host, _), contextlib.closing(Asker(host)) as asker:
        assert (
            asker.send("GET", "/api/projects", None, known)[0] == 403
        )  # another has another token
        assert len(hidden(room)) == 1  # its own
    assert eventually(lambda: not hidden(room))


def test_pages_are_written_without_a_server(room: Path, tmp_path: Path):
    Project(room, "line.flac", text="<b>", settings={"fps": 10, "life": 0}).save(
        room / "tag.elocute.json"
    )
    result = run_here("studio", room / "line.elocute.json", "--export", tmp_path / "one")
    assert (result.returncode, result.stdout) == (0, f"{tmp_path / 'one' / 'index.html'}\n"), result
    assert sorted(each.name for each in (tmp_path / "one").iterdir()) == ["index.html", "line.html"]
    assert '<a href="line.html">line</a>' in (tmp_path / "one" / "index.html").read_text()
    (tmp_path / "one" / "mine.txt").write_text("kept")
    again = run_here("studio", room / "line.elocute.json", "--export", tmp_path / "one")
    assert again.returncode == 2 and "changed since it was made" in again.stderr
    assert (tmp_path / "one" / "mine.txt").read_text() == "kept"
    refused = run_here("studio", room / "tag.elocute.json", "--export", tmp_path / "two")
    assert refused.returncode == 2 and not (tmp_path / "two").exists()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["none"], "none: no such folder"),
        (["none.elocute.json"], "none.elocute.json: no such file"),
        ([".", "--host", "0.0.0.0"], "--host: 0.0.0.0, which other machines reach"),
        ([".", "--host", "example.org"], "an address in numbers"),
        ([".", "--export", "pages"], "no projects"),
    ],
)
def test_what_cannot_be_served_is_told(words, told, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run_here("studio", *words, "--no-open")
    assert result.returncode == 2 and told in result.stderr
    assert not list(tmp_path.iterdir())
