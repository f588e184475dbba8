"""Files are written beside their name, synced to disk, and renamed when they are whole.

A draft lies in a hidden folder `.NAME.HOST-PID-….part` beside the place that it is for. A run that
was killed leaves it there; the next one that writes into the folder removes it.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import platform
import re
import shutil
import stat
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

from elocute.errors import OutputError, printable
from elocute.files.reading import path_of

STALE_DAYS = 7.0
"""Drafts of other machines, whose processes cannot be asked for, are left alone for this long."""
_FOLDERS: set[Path] = set()
"""Where this process has written, for `remove_own_drafts`."""
_EXPECTED: dict[tuple[str, str], tuple[int, int, int, int] | None] = {}
"""Places in a block of `unchanged`, and what is there as far as this run knows."""
_TOLD: dict[tuple[str, str], Callable[[Path], None]] = {}
"""Places in a block of `announced`, and whom to tell of the draft that is about to be there."""
BEFORE = "before"
_DRAFT = re.compile(r"\.(?P<host>[0-9a-f]{8})-(?P<pid>[0-9]{1,10})-\w+\.part$", re.ASCII)


def check_output(path: str | Path) -> Path:
    """Check that a file or folder can be written, before anything is computed for it.

    Raises OutputError where its folder is missing or denies writing, the name cannot exist, or a
    device, a pipe or a socket is there, which a rename would replace for everybody.
    """
    path = path_of(path, OutputError)
    folder = path.parent
    try:
        if not folder.is_dir():
            raise OutputError.about(
                path,
                found=f"folder {folder} does not exist",
                allowed="an existing folder",
                remedy=f"create it first: mkdir -p {folder}",
            )
        if not os.access(folder, os.W_OK):
            raise OutputError.about(
                path, found=f"folder {folder} cannot be written", remedy="choose another folder"
            )
        with contextlib.suppress(FileNotFoundError):
            os.lstat(path)  # asks the system whether it can have such a name at all
            mode = path.stat().st_mode
            if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):  # a rename would take its place
                raise OutputError.about(
                    path,
                    found="a device, a pipe or a socket",
                    allowed="a file or a folder",
                    remedy="choose another name",
                )
    except (OSError, ValueError) as error:
        if isinstance(error, OutputError):
            raise
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise OutputError.about(path, found=f"no possible name ({reason})") from None
    return path


@contextlib.contextmanager
def write_atomically(path: str | Path) -> Iterator[Path]:
    """Write a file that appears under its name only when the block ends without error.

    Yields where to write: a file beside `path` with the same name, since writers choose formats by
    the suffix. It is synced to disk before it takes its place, and removed where the block fails or
    is interrupted. Raises OutputError as `check_output`; for a folder; where the disk refuses or is
    full; and, in a block of `unchanged`, where something else was written there in the meantime.
    """
    path = check_output(path)
    if path.is_dir():
        raise OutputError.about(path, found="a folder", allowed="a file name")
    with _draft_folder(path) as room:
        yield room / path.name
        _sync(room / path.name)
        _take_place(room / path.name, path)


@contextlib.contextmanager
def working_folder(folder: Path, name: str) -> Iterator[Path]:
    """A hidden folder in a folder, for what this process needs while it runs; removed at the end.

    What a process that was killed leaves of it is removed as drafts are. Raises OutputError where
    it cannot be made.
    """
    with _draft_folder(check_output(folder / name)) as room:
        yield room


@contextlib.contextmanager
def unchanged(path: Path) -> Iterator[None]:
    """In this block `write_atomically` replaces `path` only as it is now, or as it wrote it."""
    place = _place(path)
    _EXPECTED[place] = _state(path)
    try:
        yield
    finally:
        _EXPECTED.pop(place, None)


@contextlib.contextmanager
def announced(path: Path, tell: Callable[[Path], None]) -> Iterator[None]:
    """In this block `tell` is called with each whole draft before it takes its place at `path`.

    A run that is killed at any moment then left either a note of what is there, or a note of what
    never came.
    """
    place = _place(path)
    _TOLD[place] = tell
    try:
        yield
    finally:
        _TOLD.pop(place, None)


def _announce(draft: Path, path: Path) -> None:
    tell = _TOLD.get(_place(path))
    if tell is not None:
        tell(draft)


def _take_place(draft: Path, path: Path) -> None:
    """Move a draft to its name. Raises OutputError where `unchanged` is broken."""
    place = _place(path)
    _announce(draft, path)
    if place not in _EXPECTED:
        draft.replace(path)
        return
    if _EXPECTED[place] != _state(path):
        raise written_meanwhile(path)
    if _EXPECTED[place] is None:
        try:
            os.link(draft, path)  # unlike a rename, it never takes the place of another file
        except FileExistsError as error:
            raise written_meanwhile(path) from error
        except OSError:  # a file system without hard links
            draft.replace(path)
    else:
        draft.replace(path)
    _EXPECTED[place] = _state(path)


def written_meanwhile(path: Path) -> OutputError:
    """The error for a file that another program wrote while this one was working."""
    return OutputError.about(
        path,
        found="it was written by something else in the meantime",
        remedy="choose another name",
    )


def _place(path: Path) -> tuple[str, str]:
    return os.path.realpath(path.parent), path.name


def _state(path: Path) -> tuple[int, int, int, int] | None:
    """What changes when a file is written or replaced; None where nothing is there."""
    try:
        facts = path.lstat()
    except FileNotFoundError:
        return None
    return facts.st_dev, facts.st_ino, facts.st_size, facts.st_mtime_ns


@contextlib.contextmanager
def write_folder_atomically(path: str | Path) -> Iterator[Path]:
    """Write a folder that appears under its name only when the block ends without error.

    Yields the folder to write into, beside `path`. Raises OutputError as `check_output`; for a name
    that exists, which is never emptied; and where the disk refuses or is full.
    """
    path = check_output(path)
    if os.path.lexists(path):
        raise OutputError.about(
            path, found="exists already", allowed="a new folder", remedy="remove it or rename"
        )
    with _draft_folder(path) as room:
        yield room
        for folder, _, names in os.walk(room):
            for name in names:
                _sync(Path(folder, name))
            _sync(Path(folder))
        room.chmod(0o755)
        _announce(room, path)
        room.replace(path)


@contextlib.contextmanager
def moved_aside(path: Path) -> Iterator[None]:
    """Move a folder out of the way until the block has written another one in its place.

    It is moved back where the block fails, and by the next run where this one is killed. Raises
    OutputError where it cannot be moved, or not moved back; it is then kept beside its place.
    """
    with _draft_folder(path) as room:
        before = room / BEFORE / path.name
        before.parent.mkdir()
        path.replace(before)
        try:
            yield
        except BaseException:
            _put_back(before, path)
            raise
        shutil.rmtree(before.parent, ignore_errors=True)


def _put_back(before: Path, path: Path) -> None:
    """Move a folder back; where its place is taken, keep it beside that under a new name.

    Raises OutputError where it is kept beside, OSError where it could not be moved at all.
    """
    try:
        if os.path.lexists(path):
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))
        before.replace(path)
    except OSError as error:
        kept = Path(tempfile.mkdtemp(prefix=f"{path.name[:32]}.before-", dir=path.parent))
        try:
            before.replace(kept / path.name)
        except BaseException:
            kept.rmdir()
            raise
        raise OutputError.about(
            path, found=f"cannot be put back; it is kept in {printable(kept)}"
        ) from error


@contextlib.contextmanager
def _draft_folder(path: Path) -> Iterator[Path]:
    """A folder for the draft of `path`, removed at the end; its errors name `path`."""
    remove_stale_drafts(path.parent)
    _FOLDERS.add(path.parent.absolute())
    room = None
    try:
        # The whole name may be as long as a name can be: its start is enough.
        start = f".{path.name[:32]}.{_host()}-{os.getpid()}-"
        room = Path(tempfile.mkdtemp(prefix=start, suffix=".part", dir=path.parent))
        yield room
        _sync(path.parent)
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError.about(path, found=f"cannot be written ({reason})") from error
    except OutputError as error:
        if room is None:
            raise
        # Files of a folder have drafts of their own: the message names where they would have been.
        raise OutputError(str(error).replace(printable(room), printable(path))) from error
    finally:
        if room is not None:
            _discard(room, path.parent)


def remove_stale_drafts(folder: Path) -> list[Path]:
    """Remove what runs that were killed left in a folder; the drafts that were removed.

    A draft is stale when its process, on this machine since it last started, has ended, or after
    `STALE_DAYS`. Nothing is done where the folder cannot be read.
    """
    removed = []
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            draft = _DRAFT.search(entry.name)
            if not draft or not entry.name.startswith(".") or not _is_stale(entry, draft):
                continue
            if _discard(Path(entry.path), folder):
                removed.append(Path(entry.path))
    return removed


def remove_own_drafts() -> None:
    """Remove what this process left where it was interrupted while it made or removed a draft.

    To be called when nothing is being written any more.
    """
    for folder in _FOLDERS:
        with contextlib.suppress(OSError), os.scandir(folder) as entries:
            for entry in entries:
                draft = _DRAFT.search(entry.name)
                if draft and draft["host"] == _host() and int(draft["pid"]) == os.getpid():
                    _discard(Path(entry.path), folder)


def _discard(draft: Path, folder: Path) -> bool:
    """Remove a draft; what was moved aside in it goes back first, or is kept beside its place.

    Where neither can be done, the draft stays for a later run to try. Returns whether it is gone.
    """
    try:
        for before in sorted((draft / BEFORE).iterdir()):
            _put_back(before, folder / before.name)
    except FileNotFoundError:
        pass  # nothing was moved aside
    except OutputError:  # it is kept beside its place
        pass
    except OSError:
        return False
    shutil.rmtree(draft, ignore_errors=True)
    return True


def _is_stale(entry: os.DirEntry[str], name: re.Match[str]) -> bool:
    """Whether a draft's process has ended, or the draft is old."""
    if entry.is_symlink() or not entry.is_dir(follow_symlinks=False):
        return False
    if time.time() - entry.stat(follow_symlinks=False).st_mtime > STALE_DAYS * 86400:
        return True
    # Windows has no signal that only asks whether a process lives.
    return os.name == "posix" and name["host"] == _host() and not _lives(int(name["pid"]))


def _lives(process: int) -> bool:
    """Whether a process of this machine runs."""
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:
        return True  # somebody else's
    return True


@cache
def _host() -> str:
    """Identifies where process numbers hold: this machine since it started, or this container.

    Containers and copies of a machine may have one name between them, on one shared folder.
    """
    parts = [platform.node()]
    with contextlib.suppress(OSError):
        parts.append(Path("/proc/sys/kernel/random/boot_id").read_text())
        parts.append(str(Path("/proc/self/ns/pid").readlink()))
    return hashlib.sha256("\n".join(parts).encode("utf-8", "replace")).hexdigest()[:8]


def _sync(path: Path) -> None:
    """Sync a file or folder to disk; file systems that cannot do it for folders do not matter."""
    is_folder = path.is_dir()
    if is_folder and os.name != "posix":
        return
    descriptor = os.open(path, os.O_RDONLY if is_folder else os.O_RDWR)
    try:
        os.fsync(descriptor)
    except OSError:
        if not is_folder:
            raise
    finally:
        os.close(descriptor)
