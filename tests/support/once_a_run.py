"""What takes long to make is made once a run, by whichever worker asks for it first."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None


@contextlib.contextmanager
def _alone(lock: Path) -> Iterator[None]:
    """No other worker is here meanwhile; a worker that dies leaves the lock open."""
    with lock.open("a") as file:
        if fcntl is not None:
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def once_a_run(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """A folder of the whole run, filled by the first worker that asks. Tests leave it as it is.

    make: is given a folder that is there and empty. What it raises is raised here, and the next
    who asks tries again.
    """
    room = factory.getbasetemp()
    if room.name.startswith("popen-"):  # a worker's own, in that of the run
        room = room.parent
    folder, done = room / "once" / name, room / "once" / f"{name}.done"
    folder.parent.mkdir(exist_ok=True)
    with _alone(folder.with_name(f"{name}.lock")):
        if not done.exists():
            attempt = sum(1 for _ in folder.parent.glob(f"{name}*"))
            if folder.exists():
                folder.rename(folder.with_name(f"{name}.failed{attempt}"))
            folder.mkdir()
            make(folder)
            done.touch()
    return folder
