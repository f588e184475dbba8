"""Bytes of a regular file, once its size is known to be allowed.

A name may lead to a pipe, a device or a folder; none is ever waited for or read.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from elocute.errors import InputError
from elocute.one_line_repr import brief

HOLES_FREE_BYTES, HOLES_TIMES = 100_000_000, 1000
"""A file may be a thousand times as long as what is stored of it, or this long."""
_WITHOUT_WAITING = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)


def path_of(name: object, error: type[InputError] = InputError) -> Path:
    """A path that a caller gave. Raises `error` for what is not one."""
    if not isinstance(name, str | os.PathLike):
        raise error.about("path", found=brief(name), allowed="the name of a file or folder")
    try:
        return Path(name)
    except TypeError:  # a path object that stands for bytes
        raise error.about("path", found=brief(name), allowed="a name as text") from None


def _stored_bytes(descriptor: int, facts: os.stat_result) -> int:
    """What of an open file is stored, where that is little and the system tells; else its size.

    A few bytes can begin a file of a terabyte that is never there, and is read for hours.
    """
    if facts.st_size <= HOLES_FREE_BYTES or not hasattr(os, "SEEK_DATA"):
        return facts.st_size
    if getattr(facts, "st_blocks", facts.st_size) * 512 * HOLES_TIMES >= facts.st_size:
        return facts.st_size
    stored = at = 0
    try:
        for _ in range(HOLES_TIMES):
            at = os.lseek(descriptor, at, os.SEEK_DATA)
            end = os.lseek(descriptor, at, os.SEEK_HOLE)
            stored, at = stored + end - at, end
        return facts.st_size  # of many parts, which nobody makes by a single call
    except OSError:  # no data after this place
        return stored
    finally:
        os.lseek(descriptor, 0, os.SEEK_SET)


@contextmanager
def open_regular(
    path: str | Path,
    *,
    max_bytes: int,
    allowed: str,
    error: type[InputError] = InputError,
    remedy: str = "",
) -> Iterator[BinaryIO]:
    """Open a regular file of at most `max_bytes` for reading; its size is that of the open file.

    `allowed` says what kind of file is wanted, `remedy` how to get one. Raises `error`, in one
    line, for a file that is missing, larger, a folder, a pipe or a device, or cannot be read;
    so does an error of the operating system inside the block.
    """
    path = path_of(path, error)
    try:
        descriptor = os.open(path, os.O_RDONLY | _WITHOUT_WAITING)
    except (OSError, ValueError) as problem:
        raise error.about(path, found=_why(path, problem), allowed=allowed, remedy=remedy) from None
    facts = os.fstat(descriptor)
    if not stat.S_ISREG(facts.st_mode):
        os.close(descriptor)  # Python makes no file of a folder
        found = "a folder" if stat.S_ISDIR(facts.st_mode) else "no regular file"
        raise error.about(path, found=found, allowed=allowed, remedy=remedy)
    with os.fdopen(descriptor, "rb") as file:
        if facts.st_size > max_bytes:
            raise error.about(
                path,
                found=bytes_text(facts.st_size),
                allowed=f"{allowed} of up to {bytes_text(max_bytes)}",
            )
        stored = _stored_bytes(descriptor, facts)
        if facts.st_size > max(HOLES_FREE_BYTES, HOLES_TIMES * stored):
            raise error.about(
                path,
                found=f"{bytes_text(facts.st_size)}, nearly all of it holes",
                allowed=allowed,
                remedy="copy it again",
            )
        try:
            yield file
        except OSError as problem:
            raise error.about(path, found=_why(path, problem), allowed=allowed) from problem


def read_bytes(
    path: str | Path,
    *,
    max_bytes: int,
    allowed: str,
    error: type[InputError] = InputError,
    remedy: str = "",
) -> bytes:
    """All bytes of a regular file of at most `max_bytes`. Raises as `open_regular`."""
    with open_regular(
        path, max_bytes=max_bytes, allowed=allowed, error=error, remedy=remedy
    ) as file:
        size = os.fstat(file.fileno()).st_size
        data = file.read(size + 1)  # asks for that much memory at once, so never for max_bytes
    if len(data) > size:  # it grew after its size was asked for
        raise error.about(
            path, found="a growing file", allowed=f"{allowed} of up to {bytes_text(max_bytes)}"
        )
    return data


def read_text(
    path: str | Path,
    *,
    max_bytes: int,
    allowed: str,
    error: type[InputError] = InputError,
    remedy: str = "",
) -> str:
    """UTF-8 text, with or without a byte-order mark. Raises as `open_regular`."""
    data = read_bytes(path, max_bytes=max_bytes, allowed=allowed, error=error, remedy=remedy)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        raise error.about(
            path, found=f"byte {problem.start} is not UTF-8", allowed=allowed, remedy=remedy
        ) from None


def bytes_text(count: int) -> str:
    """A number of bytes as a person reads it."""
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= size:
            return f"{count / size:.4g} {unit}"
    return f"{count} bytes"


def _why(path: Path, problem: OSError | ValueError) -> str:
    if isinstance(problem, FileNotFoundError):
        return "no such file"
    denied = isinstance(problem, PermissionError)  # so Windows calls it to open a folder
    if isinstance(problem, IsADirectoryError) or (denied and path.is_dir()):
        return "a folder"
    reason = problem.strerror if isinstance(problem, OSError) else str(problem)
    return f"cannot be read ({reason or 'unknown reason'})"


def is_file(path: Path) -> bool:
    """Whether a file is there; not where there cannot be one of such a name."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
