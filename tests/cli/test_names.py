"""Names of files that are no plain names: each works, and is told in one line."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pytest

from tests.support.commands import run_bytes, succeeds

NAMES = [
    b"\xff\xfe.wav",
    b"talk:1.wav",
    b"file:x.wav",
    b"-x.wav",
    b"two\nlines.wav",
    b"quo'te\".wav",
    b"%d.wav",
    "\N{GRINNING FACE}é.wav".encode(),
    b"[bold]x.wav",
    b"a  b.wav",
    b"\x1b[31mred.wav",
    b"n" * 240 + b".wav",
]
FEW = NAMES[:5]
"""Of each sort one: no text, an address, an option, two lines; the others are marked slow."""


def names(among: list[bytes]) -> list[Any]:
    return [
        pytest.param(n, marks=[] if n in FEW else [pytest.mark.slow], id=repr(n)) for n in among
    ]


def run(*arguments: bytes | str, cwd: Path, **environment: str) -> CompletedProcess[bytes]:
    return run_bytes(*arguments, cwd=cwd, env=os.environ | environment)


@pytest.fixture
def folder(tmp_path: Path, speech_wav: Path) -> Path:
    import soundfile

    samples, rate = soundfile.read(speech_wav, start=32000, stop=48000)
    soundfile.write(tmp_path / "plain.wav", samples, rate)
    return tmp_path


@pytest.mark.skipif(sys.platform != "linux", reason="other systems refuse some of these names")
def written(name: bytes, folder: Path, *suffixes: bytes) -> list[bytes]:
    """The sound gets that name; what is made of it then."""
    (folder / "plain.wav").rename(folder / os.fsdecode(name))
    return [name.removesuffix(b".wav") + suffix for suffix in suffixes]


def outputs(paths: list[bytes]) -> list[bytes]:
    return [word for path in paths for word in (b"-o", path)]


def files_in(folder: Path) -> list[bytes]:
    return sorted(os.fsencode(path.name) for path in folder.iterdir())


@pytest.mark.parametrize("name", names(NAMES))
@pytest.mark.parametrize("encoding", [pytest.param("utf-8", marks=pytest.mark.slow), "ascii"])
def test_it_is_read_and_written(name: bytes, encoding: str, folder: Path) -> None:
    made = written(name, folder, b".npz")
    words = "animate", "--fps", "5", *outputs(made), "--", name
    done = run(*words, cwd=folder, PYTHONIOENCODING=encoding)
    told = [line for line in done.stderr.splitlines() if b"no speech heard" not in line]
    assert (done.returncode, told) == (0, []), done.stderr
    assert done.stdout.count(b"\n") == len(made) and b"\x1b" not in done.stdout
    assert files_in(folder) == sorted([name, *made])


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES, ids=repr)
def test_every_format_takes_it(name: bytes, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = written(name, folder, b".npz", b".glb", b".html", b".csv", b".mp4")
    monkeypatch.chdir(folder)
    drawing = "--size", "64", "--backend", "embreex", "--embed-audio"
    done = succeeds("animate", "--fps", "5", *drawing, *outputs(made), "--", name)
    assert done.stdout.count("\n") == len(made) and "\x1b" not in done.stdout
    assert files_in(folder) == sorted([name, *made])


@pytest.mark.parametrize("name", names([n for n in NAMES if len(n) < 200]))
def test_an_error_about_it_is_one_clear_line(name: bytes, folder: Path) -> None:
    done = run("animate", "-o", "x.npz", "--", name, cwd=folder, LC_ALL="C")
    assert done.returncode == 2 and done.stderr.count(b"\n") == 1
    assert done.stderr.endswith(b"\n") and b"\x1b" not in done.stderr
    assert b"no such file" in done.stderr
