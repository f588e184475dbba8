"""Nothing that Elocute does at run time reaches for a network."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest
import soundfile

from tests.support.commands import python, run_python
from tests.support.espeak import has_espeak
from tests.support.whisper import whisper_folder

ROOT = Path(__file__).parents[2]
FEW = ["--fps", "10"]
SMALL = [*FEW, "--size", "64"]


@pytest.fixture(scope="module")
def commands(tmp_path_factory, speech_wav) -> Path:
    """A file of commands that hear, move, draw, write and read one second of the example."""
    folder = tmp_path_factory.mktemp("offline")
    samples, rate = soundfile.read(speech_wav, frames=32000)
    say, talk, model = str(folder / "say.wav"), str(folder / "talk.npz"), str(folder / "model.npz")
    soundfile.write(say, samples, rate)

    def outputs(*names: str) -> list[str]:
        return [part for name in names for part in ("-o", str(folder / name))]

    steps = [
        ["doctor"],
        ["animate", say, *SMALL, *outputs("talk.npz", "talk.mp4", "talk.html", "talk.glb")],
        ["animate", str(folder / "talk.mp4"), "--model", "voca", *FEW, *outputs("heard.csv")],
        ["animate", say, "--model", "crnn", *FEW, *outputs("model.npz")],
        ["render", talk, "--audio", say, *SMALL, *outputs("sheet.png")],
        ["convert", model, "--to", "vrm", *outputs("vrm.json")],
        ["measure", model, *outputs("mouth.csv")],
        ["edit", talk, "--blinks", "0.3", *outputs("edited.glb")],
        ["info", say],
        ["head", "show", "builtin"],
        ["align", say, say, "--method", "dtw"],
        ["evaluate", "noise", say, "--levels=-12"],
    ]
    if has_espeak():
        steps.append(["say", "Hello.", *FEW, *outputs("said.npz")])
        if (model := whisper_folder()) is not None:
            listen = ["--transcribe", "--recogniser", str(model)]
            steps.append(["phones", say, *listen, *outputs("said.json")])
    path = folder / "commands.json"
    path.write_text(json.dumps(steps), encoding="utf-8")
    return path


ALONE = ["unshare", "--map-root-user", "--net"]
"""In a network of its own that holds nothing, not even this machine."""
WATCHED = ["strace", "--follow-forks", "--seccomp-bpf", "--quiet=all", "--trace=socket,connect"]
"""FFmpeg, onnxruntime and the renderer are asked by the kernel, not by Python."""


def can(*before: str) -> bool:
    """Whether a program is here, and may do what it does."""
    return bool(shutil.which(before[0])) and not subprocess.run([*before, "true"]).returncode


@dataclass(frozen=True)
class Watch:
    """What became of the commands, each way of watching at once; None: it is not here."""

    home: Path
    alone: bool
    calls: str | None


@pytest.fixture(scope="module")
def watched(commands: Path, tmp_path_factory: pytest.TempPathFactory) -> Watch:
    """All commands once. A socket ends them by the hook, a network is not there to be reached."""
    folder = tmp_path_factory.mktemp("watched")
    home, log = folder / "home", folder / "calls"
    home.mkdir()
    strace = [*WATCHED, f"--output={log}"]
    before = [*(strace if can(*strace) else []), *(ALONE if can(*ALONE) else [])]
    done = subprocess.run(
        [*before, *python("-m", "tests.promises.offline", commands)],
        env=os.environ | {"HOME": str(home), "XDG_STATE_HOME": str(home / "state")},
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    assert done.returncode == 0, done.stderr
    calls = log.read_text(encoding="utf-8") if before[:1] == WATCHED[:1] else None
    return Watch(home, ALONE[0] in before, calls)


def test_no_library_keeps_anything_of_its_own_in_the_home_folder(watched: Watch):
    """onnxruntime 1.31 keeps an identifier there, and what it would send to its maker."""
    home = watched.home
    kept = {path.relative_to(home).parts[0] for path in home.rglob("*") if path.is_file()}
    assert kept <= {"state"}


@pytest.mark.system
def test_every_command_works_without_any_network(watched: Watch, need):
    need(watched.alone, "unshare, and the right to a network namespace")


@pytest.mark.system
def test_no_library_below_python_opens_a_socket(watched: Watch, need):
    need(watched.calls is not None, "strace, and the right to trace")
    assert re.findall(r".*AF_INET.*", watched.calls or "") == []


@pytest.mark.parametrize(
    "reach",
    [
        "import socket; socket.create_connection(('127.0.0.1', 9))",
        "import socket; socket.getaddrinfo('localhost', 80)",
        "import urllib.request; urllib.request.urlopen('http://127.0.0.1:9/')",
    ],
)
def test_the_hook_tells_of_any_attempt(reach):
    start = "import contextlib, sys; from tests.promises import offline\n"
    start += "sys.addaudithook(offline.refuse)"
    code = f"{start}\nwith contextlib.suppress(Exception):\n    {reach}"
    done = run_python("-c", code, cwd=ROOT)
    assert done.returncode == 99 and done.stderr.startswith("network: ")
