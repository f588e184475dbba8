"""Every step of writing fails once, or from then on: what was there is never lost.

As SQLite's tests do it: the n-th call that can fail is made to, for every n until nothing fails.
"""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from elocute.errors import OutputError
from elocute.files.atomic import (
    moved_aside,
    remove_stale_drafts,
    unchanged,
    write_atomically,
    write_folder_atomically,
)

OLD, NEW = "what was there " * 1_000, "what is new " * 1_000
STEPS = {
    "write": [(Path, "write_text")],
    "fsync": [(os, "fsync")],
    "rename": [(Path, "replace"), (os, "link")],
    "folder": [(os, "mkdir"), (Path, "mkdir"), (Path, "chmod"), (tempfile, "mkdtemp")],
    "open": [(os, "open")],
}
STEPS["any"] = [step for steps in STEPS.values() for step in steps]
ERRORS = {
    "full": lambda: OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)),
    "memory": MemoryError,
}


class Faults:
    """Makes the n-th call of some functions fail, or all from the n-th on."""

    def __init__(self, at: int, error: Callable[[], BaseException], lasting: bool) -> None:
        self.at, self.error, self.lasting = at, error, lasting
        self.calls, self.failed = 0, 0

    @contextmanager
    def of(self, steps: list[tuple[object, str]]) -> Iterator[None]:
        with pytest.MonkeyPatch.context() as patch:
            for owner, name in steps:
                patch.setattr(owner, name, self._failing(getattr(owner, name)))
            yield

    def _failing(self, usual: Callable[..., object]) -> Callable[..., object]:
        def call(*given: object, **more: object) -> object:
            if "dir_fd" in more:  # of rmtree, which removes drafts and can do without
                return usual(*given, **more)
            self.calls += 1
            if self.calls == self.at or (self.lasting and self.calls > self.at):
                self.failed += 1
                raise self.error()
            return usual(*given, **more)

        return call


def a_file(place: Path) -> None:
    with write_atomically(place) as draft:
        draft.write_text(NEW)


def a_known_file(place: Path) -> None:
    with unchanged(place), write_atomically(place) as draft:
        draft.write_text(NEW)


def a_folder(place: Path) -> None:
    with write_folder_atomically(place) as room:
        for name in ("one", "two"):
            (room / name).write_text(NEW)


def a_folder_again(place: Path) -> None:
    with moved_aside(place):
        a_folder(place)


def content(place: Path) -> object:
    """The text of a file, or what a folder holds."""
    return found_in(place) if place.is_dir() else place.read_text()


def found_in(folder: Path) -> dict[str, object]:
    """What a folder holds, but for drafts, which hide."""
    seen = (each for each in folder.iterdir() if not each.name.startswith("."))
    return {each.name: content(each) for each in seen}


FOLDER_OLD, FOLDER_NEW = {"one": OLD, "three": OLD}, {"one": NEW, "two": NEW}
WRITERS = [
    (a_file, None, NEW),
    (a_file, OLD, NEW),
    (a_known_file, None, NEW),
    (a_known_file, OLD, NEW),
    (a_folder, None, FOLDER_NEW),
    (a_folder_again, FOLDER_OLD, FOLDER_NEW),
]


def prepare(place: Path, old: object) -> None:
    if isinstance(old, dict):
        place.mkdir()
        for name, text in old.items():
            (place / name).write_text(text)
    elif isinstance(old, str):
        place.write_text(old)


@pytest.mark.parametrize("lasting", [False, True], ids=["once", "from_then_on"])
@pytest.mark.parametrize("error", ERRORS)
@pytest.mark.parametrize("steps", STEPS)
@pytest.mark.parametrize(
    ("write", "old", "new"), WRITERS, ids=lambda each: getattr(each, "__name__", "")
)
def test_whatever_fails_nothing_is_lost(tmp_path, write, old, new, steps, error, lasting):
    for at in range(1, 100):
        folder = tmp_path / str(at)
        folder.mkdir()
        place = folder / "take"
        prepare(place, old)
        faults = Faults(at, ERRORS[error], lasting)
        raised = None
        with faults.of(STEPS[steps]):
            try:
                write(place)
            except (OutputError, MemoryError, OSError) as problem:
                raised = problem
        if not faults.failed:
            assert raised is None and found_in(folder) == {"take": new}
            return
        if raised is not None:
            assert isinstance(raised, OutputError | MemoryError) and "\n" not in str(raised)
        left = found_in(folder)
        if "take" not in left and old is not None:  # it could not be moved back by then
            (room,) = folder.glob(".take.*.part")
            room.rename(room.with_name(room.name.replace(f"-{os.getpid()}-", "-2147483646-")))
            remove_stale_drafts(folder)  # the next run moves it back
            left = found_in(folder)
        assert left.get("take") in ((old, new) if raised is not None else (new,))
        kept = {name: each for name, each in left.items() if name != "take"}
        assert all(each == {"take": old} for each in kept.values())  # beside what took its place
        if left.get("take") != new:
            write(place)
        assert found_in(folder) == {"take": new} | kept
        shutil.rmtree(folder)
    raise AssertionError("more than a hundred steps")
