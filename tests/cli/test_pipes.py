"""`-` for standard input and output, and outputs that nobody can write."""

from __future__ import annotations

import io
import json
import os
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import soundfile

from elocute.motion.store import load_motion
from tests.support.commands import run_bytes as run

posix = pytest.mark.skipif(os.name != "posix", reason="shells and devices of Unix")


@pytest.fixture(scope="module")
def wav(speech_wav: Path) -> bytes:
    """A second of speech."""
    samples, rate = soundfile.read(speech_wav, start=32000, stop=64000)
    packed = io.BytesIO()
    soundfile.write(packed, samples, rate, "PCM_16", format="WAV")
    return packed.getvalue()


def test_sound_in_and_curves_out(wav: bytes) -> None:
    done = run("animate", "-", "-o", "-", "--format", "json", input=wav)
    assert (done.returncode, done.stderr) == (0, b"")
    curves = json.loads(done.stdout)
    assert curves["fps"] == 60 and len(curves["frames"]) == 60
    assert len(curves["names"]) == len(curves["frames"][0])
    jaw = curves["names"].index("jawOpen")
    assert max(frame[jaw] for frame in curves["frames"]) > 0.1
    done = run("animate", "-", "-o", "-", "--format", "csv", input=wav)
    assert done.stdout.startswith(b"Timecode,") and done.stdout.count(b"\n") == 61


def test_a_wav_whose_writer_did_not_know_its_length(wav: bytes, tmp_path: Path) -> None:
    place = wav.index(b"data") + 4
    unknown = wav[:4] + struct.pack("<I", 0xFFFFFFFF) + wav[8:place]
    unknown += struct.pack("<I", 0xFFFFFFFF) + wav[place + 4 :]
    for name, given in (("known", wav), ("unknown", unknown)):
        done = run("animate", "-", "-o", tmp_path / f"{name}.npz", input=given)
        assert done.returncode == 0, done.stderr
    known, other = (load_motion(tmp_path / f"{name}.npz") for name in ("known", "unknown"))
    assert (known.weights == other.weights).all()


def test_bytes_of_other_formats_go_out_too(wav: bytes) -> None:
    for kind, start in (("npz", b"PK"), ("glb", b"glTF"), ("html", b"<!doctype")):
        done = run("animate", "-", "-o", "-", "--format", kind, "--look", "none", input=wav)
        assert (done.returncode, done.stderr) == (0, b"") and done.stdout.startswith(start)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("-", "-", "-o", "x.npz"), b"given twice"),
        (("-", "-o", "-"), b"--format csv"),
        (("-", "-o", "-", "--format", "obj"), b"one file"),
        (("-", "-o", "-", "--format", "avi"), b".avi"),
        (("-", "-o", "-", "--format", "csv", "--json"), b"one of -o - and --json"),
        (("-", "-o", "-", "--format", "csv"), b"standard input: no sound"),
    ],
)
def test_what_makes_no_sense_is_one_line(arguments: tuple, says: bytes) -> None:
    done = run("animate", *arguments, input=b"no sound at all")
    assert (done.returncode, done.stdout) == (2, b"")
    assert done.stderr.count(b"\n") == 1 and says in done.stderr, done.stderr


@posix
@pytest.mark.parametrize("command", ["animate {wav} -o - --format csv", "--help", "info {wav}"])
def test_nobody_reads_it_and_nothing_is_said(command: str, wav: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.wav").write_bytes(wav)
    words = [word.format(wav=tmp_path / "a.wav") for word in command.split()]
    reads, writes = os.pipe()
    os.close(reads)
    done = run(*words, stdout=writes)
    os.close(writes)
    assert (done.returncode, done.stderr) == (141, b"")


@posix
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="Linux has /dev/full")
@pytest.mark.parametrize("command", ["animate {wav} -o - --format csv", "--help", "info {wav}"])
def test_a_full_output_is_one_line(command: str, wav: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.wav").write_bytes(wav)
    words = [word.format(wav=tmp_path / "a.wav") for word in command.split()]
    with Path("/dev/full").open("wb") as full:
        done = run(*words, stdout=full)
    assert done.returncode == 2 and done.stderr.count(b"\n") == 1
    assert done.stderr.startswith(b"elocute: standard output: cannot be written")


@posix
def test_without_standard_streams_files_are_whole(wav: bytes, tmp_path: Path) -> None:
    """What is printed must not go into a file that took the number of standard output."""
    (tmp_path / "a.wav").write_bytes(wav)
    line = f"exec {sys.executable} -m elocute animate a.wav -o a.npz -o a.csv <&- >&- 2>&-"
    done = subprocess.run(["sh", "-c", line], cwd=tmp_path, check=False)
    assert done.returncode == 0 and load_motion(tmp_path / "a.npz").frame_count == 60
    assert (tmp_path / "a.csv").read_text().startswith("Timecode")


def test_curves_are_told_and_rendered(
    wav: bytes, tmp_path: Path, cli: Callable[..., Any], refused: Callable[..., None]
) -> None:
    sound, curves = tmp_path / "a.wav", tmp_path / "a.json"
    sound.write_bytes(wav)
    cli("animate", sound, "-o", curves, "-o", tmp_path / "a.npz")
    assert "curves" in cli("info", curves).stdout
    cli("render", curves, "-o", tmp_path / "b.npz")
    first, second = load_motion(tmp_path / "a.npz"), load_motion(tmp_path / "b.npz")
    assert abs(first.weights - second.weights).max() < 1e-6
    for number, (damage, says) in enumerate(
        (('"names"', "names"), ('"fps"', "frame rate"), ("],", "number"), ("curves", "format"))
    ):
        bad = tmp_path / f"bad{number}.json"
        bad.write_text(curves.read_text().replace(damage, '"x"' if '"' in damage else "x"))
        refused("info", bad, says=bad.name if damage == "]," else says)


@posix
def test_a_recording_that_comes_by_standard_input_is_not_replaced(
    wav: bytes, tmp_path: Path
) -> None:
    recording = tmp_path / "take.wav"
    recording.write_bytes(wav)
    with recording.open("rb") as file:
        done = run("animate", "-", "-o", tmp_path / "take.glb", "--overwrite", stdin=file)
    assert done.returncode == 2 and b"take.wav" in done.stderr and done.stderr.count(b"\n") == 1
    assert recording.read_bytes() == wav and not (tmp_path / "take.glb").exists()
