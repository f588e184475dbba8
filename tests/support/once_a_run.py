"""What takes long to make is made once a run, by whichever worker asks for it first."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None


@contextlib.contextmanager
def alone(lock: Path) -> Iterator[None]:
    """No other worker is here meanwhile; a worker that dies leaves the lock open."""
    with lock.open("a") as file:
        if fcntl is not None:
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def folder_of_run(factory: pytest.TempPathFactory) -> Path:
    """A folder that all workers of a run have in common."""
    room = factory.getbasetemp()
    if room.name.startswith("popen-"):  # a worker's own, in that of the run
        room = room.parent
    (room / "once").mkdir(exist_ok=True)
    return room / "once"


def once_a_run(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """A folder of the whole run, filled by the first worker that asks. Tests leave it as it is.

    make: is given a folder that is there and empty. What it raises is raised here, and the next
    who asks tries again.
    """
    folder = folder_of_run(factory) / name
    done = folder.with_name(f"{name}.done")
    with alone(folder.with_name(f"{name}.lock")):
        if not done.exists():
            shutil.rmtree(folder, ignore_errors=True)  # what an attempt left that failed
            folder.mkdir()
            make(folder)
            done.touch()
    return folder
