"""Nothing that Elocute does at run time reaches for a network."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
import soundfile

from elocute.audio.espeak import has_espeak
from tests.support.commands import python, run_python

ROOT = Path(__file__).parents[2]
FEW = ["--fps", "25"]
SMALL = [*FEW, "--size", "128"]


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
        ["render", talk, "--audio", say, *SMALL, *outputs("again.mp4", "sheet.png")],
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
    path = folder / "commands.json"
    path.write_text(json.dumps(steps), encoding="utf-8")
    return path


def started(commands: Path, *before: str) -> subprocess.CompletedProcess[str]:
    command = [*before, *python("-m", "tests.promises.offline", commands)]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT)


def test_no_command_opens_a_socket(commands):
    done = started(commands)
    assert done.returncode == 0, done.stderr


def test_no_library_keeps_anything_of_its_own_in_the_home_folder(commands, tmp_path):
    """onnxruntime 1.31 keeps an identifier there, and what it would send to its maker."""
    home = os.environ | {"HOME": str(tmp_path), "XDG_STATE_HOME": str(tmp_path / "state")}
    done = subprocess.run(
        python("-m", "tests.promises.offline", commands), env=home, cwd=ROOT, capture_output=True
    )
    assert done.returncode == 0, done.stderr
    kept = {path.relative_to(tmp_path).parts[0] for path in tmp_path.rglob("*") if path.is_file()}
    assert kept <= {"state"}


@pytest.mark.system
def test_every_command_works_without_any_network(commands, need):
    """In a network of its own that holds nothing, not even this machine."""
    alone = ["unshare", "--map-root-user", "--net"]
    can = shutil.which("unshare") and not subprocess.run([*alone, "true"]).returncode
    need(can, "unshare, and the right to a network namespace")
    done = started(commands, *alone)
    assert done.returncode == 0, done.stderr


@pytest.mark.system
def test_no_library_below_python_opens_a_socket_either(commands, tmp_path, need):
    """FFmpeg, onnxruntime and the renderer are asked by the kernel, not by Python."""
    log = tmp_path / "calls"
    watch = ["strace", "--follow-forks", "--quiet=all", "--trace=socket,connect", f"--output={log}"]
    can = shutil.which("strace") and not subprocess.run([*watch, "true"]).returncode
    need(can, "strace, and the right to trace")
    done = started(commands, *watch)
    assert done.returncode == 0, done.stderr
    assert re.findall(r".*AF_INET.*", log.read_text(encoding="utf-8")) == []


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
