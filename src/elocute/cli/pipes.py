"""`-` for standard input and output."""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from elocute.errors import InputError, OutputError

if TYPE_CHECKING:
    from elocute.audio.speech_input import BinaryFile

PIPE = Path("-")
STDIN, STDOUT = "standard input", "standard output"
FOLDERS = ("obj", "ply")


def check_pipes(speech: list[Path], output: list[Path], formats: list[str], as_json: bool) -> None:
    """Raise InputError where `-` stands for more than one thing, or does not say for what."""
    from elocute.export.registry import check_suffix

    if speech.count(PIPE) > 1 or output.count(PIPE) > 1:
        raise InputError.about("-", found="given twice", allowed=f"once: {STDIN} or {STDOUT}")
    if PIPE in speech and sys.stdin.isatty():
        raise InputError.about(STDIN, found="a terminal", allowed="a sound, from a pipe or a file")
    if PIPE not in output:
        return
    if sys.__stdout__ is None:
        raise OutputError.about(STDOUT, found="closed", allowed="a pipe or a file, where -o is -")
    if len(speech) > 1 or any(path.is_dir() for path in speech):
        raise OutputError.about(
            "-o -", found="several recordings", allowed="one", remedy="use -o FOLDER"
        )
    if len(formats) != 1 or formats[0].lstrip(".").lower() in FOLDERS:
        found = f"--format {' '.join(formats)}" if formats else "no --format"
        raise OutputError.about(
            "-o -",
            found=found,
            allowed="one format that is one file: csv, json, npz, glb, …",
            remedy="add --format csv",
        )
    check_suffix(f"-o - --format .{formats[0].lstrip('.')}")
    if as_json:
        raise OutputError.about(
            "--json", found=f"two things for {STDOUT}", allowed="one of -o - and --json"
        )


def piped_sound() -> BinaryFile:
    """Standard input, as a binary file whose name tells what it is."""
    return _Named(sys.stdin.buffer)


def stdin_source() -> str:
    """What outputs of standard input are made from: something else every time."""
    return f"{STDIN} at {time.time_ns()}"


@contextmanager
def to_stdout(format: str) -> Iterator[Path]:
    """A place to write to, whose bytes go to standard output when the block ends."""
    with tempfile.TemporaryDirectory(prefix="elocute-") as folder:
        place = Path(folder) / f"talk.{format.lstrip('.')}"
        yield place
        with place.open("rb") as file:
            shutil.copyfileobj(file, sys.stdout.buffer)
        sys.stdout.buffer.flush()


class _Named:
    """A binary file called standard input in errors."""

    name = STDIN

    def __init__(self, file: BinaryIO) -> None:
        self.read = file.read
