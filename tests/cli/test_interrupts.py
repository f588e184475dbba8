"""Ctrl-C at any moment: one line, exit 130, whole files or none."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from elocute.motion.store import load_motion
from tests.support.commands import TIMEOUT_S, python

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of Unix")
# It says when `main` has begun to import the module it is given: Ctrl-C is ours to mind from the
# first one on, other signals from where they are handled.
START = """
import os, sys
from elocute.cli import main
class Notice:
    def find_spec(name, *_):
        if name == sys.argv[1]:
            sys.meta_path.remove(Notice)
            del sys.argv[1]
            os.write(1, b".")
sys.meta_path.insert(0, Notice)
main()
"""
FIRST = "elocute.cli.entry_point"
HANDLED = "elocute.cli.app"
# A suite that runs in the background of a script was started with Ctrl-C ignored, under nohup with
# SIGHUP ignored; what it starts would inherit that.
AS_FROM_A_TERMINAL = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "signal.signal(signal.SIGHUP, signal.SIG_DFL); signal.signal(signal.SIGTERM, signal.SIG_DFL); "
)


def interrupted(
    *arguments: object, after_s: float, cwd: Path, by: int = signal.SIGINT
) -> tuple[int, str]:
    """Exit code and stderr; the whole group hears it, as from a terminal."""
    begins = FIRST if by == signal.SIGINT else HANDLED
    with subprocess.Popen(
        python("-c", AS_FROM_A_TERMINAL + START, begins, *arguments),
        cwd=cwd,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    ) as process:
        assert process.stdout is not None
        assert os.read(process.stdout.fileno(), 1) == b"."
        time.sleep(after_s)
        os.killpg(process.pid, by)
        try:
            _, said = process.communicate(timeout=TIMEOUT_S)
        finally:
            process.kill()
    return process.returncode, said.decode()


def check(
    code: int, said: str, folder: Path, expected: int = 130, word: str = "interrupted"
) -> None:
    if code != 0:
        assert code == expected and said.startswith(f"elocute: {word}; "), said
        assert said.count("\n") == 1, said
    assert not [path for path in folder.iterdir() if path.name.endswith(".part")]


MOMENTS_S = [
    pytest.param(after_s, marks=[] if place % 4 == 3 else [pytest.mark.slow])
    for place, after_s in enumerate(np.geomspace(0.002, 3, 12).round(3))
]


@pytest.mark.parametrize("after_s", MOMENTS_S)
def test_one_recording(after_s: float, speech_wav: Path, tmp_path: Path) -> None:
    code, said = interrupted(
        "animate", speech_wav, "-o", "t.npz", "-o", "t.csv", after_s=after_s, cwd=tmp_path
    )
    check(code, said, tmp_path)
    for path in tmp_path.glob("*.npz"):
        assert load_motion(path).frame_count == 640
    for path in tmp_path.glob("*.csv"):
        assert path.read_text().count("\n") == 641
    assert (code == 0) == ((tmp_path / "t.csv").exists() and not said)


@pytest.mark.slow
@pytest.mark.parametrize("after_s", [0.05, 0.5, 1.0, 1.5, 2.0, 3.0])
def test_many_tell_how_many_are_done(after_s: float, speech_wav: Path, tmp_path: Path) -> None:
    sounds = [tmp_path / f"{number}.flac" for number in range(8)]
    for sound in sounds:
        sound.write_bytes(speech_wav.read_bytes())
    code, said = interrupted("animate", *sounds, "-o", "out", after_s=after_s, cwd=tmp_path)
    check(code, said, tmp_path)
    done = list(tmp_path.glob("out/*.npz"))
    if " of 8 done" in said:
        told = int(said.split("; ")[1].split(" of ")[0])
        assert told in (len(done), len(done) - 1)  # between a file and its count
    for path in done:
        assert load_motion(path).frame_count == 640


@pytest.mark.slow
@pytest.mark.parametrize("after_s", [0.7, 1.4, 2.5])
def test_video(after_s: float, speech_wav: Path, tmp_path: Path) -> None:
    code, said = interrupted(
        "animate",
        speech_wav,
        "-o",
        "t.mp4",
        "--size",
        "128",
        "--backend",
        "embreex",
        after_s=after_s,
        cwd=tmp_path,
    )
    check(code, said, tmp_path)
    assert code == 0 or not (tmp_path / "t.mp4").exists()


@pytest.mark.slow
@pytest.mark.parametrize("after_s", [0.3, 0.8, 1.2, 1.6, 2.5])
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_service_that_stops_and_a_terminal_that_closes(
    name: str, after_s: float, speech_wav: Path, tmp_path: Path
) -> None:
    number = getattr(signal, name)
    code, said = interrupted(
        *("animate", speech_wav, "-o", "t.npz", "-o", "t.glb", "-o", "t.html"),
        after_s=after_s,
        cwd=tmp_path,
        by=number,
    )
    word = {"SIGTERM": "terminated", "SIGHUP": "hung up"}[name]
    check(code, said, tmp_path, 128 + number, word)
    for path in tmp_path.glob("*.npz"):
        assert load_motion(path).frame_count == 640


@pytest.mark.parametrize(
    ("by", "expected"), [(0, "seek of closed file"), (signal.SIGINT, "elocute: interrupted; ")]
)
def test_files_that_an_interruption_left_open_do_not_complain(
    by: int, expected: str, tmp_path: Path
) -> None:
    """It comes from within, as the command begins its work: at no other moment than this."""
    left_open = f"""
import atexit, os, sys, zipfile
from elocute.cli import main
left = zipfile.ZipFile('left.zip', 'w'); left.fp.close()
atexit.register(lambda: globals().pop('left'))
class Notice:
    def find_spec(name, *_):
        if name == "numpy":
            sys.meta_path.remove(Notice)
            os.kill(os.getpid(), {int(by)})
sys.meta_path.insert(0, Notice)
main()
"""
    words = python("-c", AS_FROM_A_TERMINAL + left_open, "head", "show", "builtin")
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=TIMEOUT_S)
    assert expected in done.stderr and (done.stderr.count("\n") == 1) == bool(by), done.stderr
    assert done.returncode == (130 if by else 0)


def test_one_while_a_class_is_made(tmp_path: Path) -> None:
    """Python 3.11 makes a RuntimeError of what a descriptor's `__set_name__` raises."""
    classes = """
import os, signal, sys
from elocute.cli import main
class Descriptor:
    def __set_name__(self, *_):
        os.kill(os.getpid(), signal.SIGINT)
class Notice:
    def find_spec(name, *_):
        if name == "elocute.cli.entry_point":
            class Made:
                one = Descriptor()
sys.meta_path.insert(0, Notice)
main()
"""
    words = python("-c", AS_FROM_A_TERMINAL + classes, "--version")
    process = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=TIMEOUT_S)
    check(process.returncode, process.stderr, tmp_path)
    assert process.returncode == 130


def test_nohup_is_heeded(speech_wav: Path, tmp_path: Path) -> None:
    code = "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN); " + START
    words = python("-c", code, HANDLED, "animate", speech_wav, "-o", "t.npz")
    process = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert os.read(process.stdout.fileno(), 1) == b"."
    process.send_signal(signal.SIGHUP)
    process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0 and (tmp_path / "t.npz").exists()


def test_a_background_job_of_a_script_goes_on(speech_wav: Path, tmp_path: Path) -> None:
    """Shells start those with Ctrl-C ignored, and so it stays."""
    code = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN); " + START
    process = subprocess.Popen(
        python("-c", code, HANDLED, "animate", speech_wav, "-o", "t.npz"),
        cwd=tmp_path,
        stdout=subprocess.PIPE,
    )
    assert process.stdout is not None
    assert os.read(process.stdout.fileno(), 1) == b"."
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0 and (tmp_path / "t.npz").exists()
