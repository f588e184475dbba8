"""The bytes of a regular file, read once its size is known to be allowed.

A name may lead to a pipe, a device or a folder; none of them is ever waited for or read.
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

HOLES_FREE_BYTES, HOLES_TIMES = 1_000_000_000, 1000
"""A file may be a thousand times as long as what is stored of it, or this long."""
_WITHOUT_WAITING = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)


def path_of(name: object, error: type[InputError] = InputError) -> Path:
    """A path that a caller gave.

    Parameters
    ----------
    name : object
        Text or a path object.
    error : type of InputError
        The class to raise.

    Returns
    -------
    Path
        The path.

    Raises
    ------
    InputError
        Of the class `error`, for anything else.
    """
    if not isinstance(name, str | os.PathLike):
        raise error.about("path", found=brief(name), allowed="the name of a file or folder")
    try:
        return Path(name)
    except Exception:  # an object of the caller's that stands for bytes, a number or an error
        raise error.about("path", found=brief(name), allowed="a name as text") from None


def stored_bytes(file: BinaryIO) -> int:
    """How much of a file is stored, where that is little and the system tells; else its size.

    A few bytes can begin a file of a terabyte that is never there, and is read for hours.

    Parameters
    ----------
    file : binary file
        Open, and not read from yet.

    Returns
    -------
    int
        Bytes.
    """
    descriptor = file.fileno()
    facts = os.fstat(descriptor)
    if not hasattr(os, "SEEK_DATA"):
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
    """Open a regular file of limited size for reading.

    Parameters
    ----------
    path : str or Path
        The file.
    max_bytes : int
        Largest size of the file, bytes.
    allowed, remedy : str
        What kind of file is wanted, and how to get one; both appear in the error message.
    error : type of InputError
        The class to raise.

    Yields
    ------
    binary file
        Open; its size is checked on the open file.

    Raises
    ------
    InputError
        Of the class `error`, for a file that is missing, larger, a folder, a pipe or a device, or
        cannot be read; also for errors of the operating system inside the block.
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
        stored = stored_bytes(file)
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
    """Read a regular file of limited size.

    Parameters
    ----------
    path, max_bytes, allowed, error, remedy
        As for `open_regular`.

    Returns
    -------
    bytes
        All of it.

    Raises
    ------
    InputError
        As `open_regular`, and for a file that grows meanwhile.
    """
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
    """Read UTF-8 text, with or without a byte-order mark, or UTF-16 with one.

    Parameters
    ----------
    path, max_bytes, allowed, error, remedy
        As for `open_regular`.

    Returns
    -------
    str
        All of it.

    Raises
    ------
    InputError
        As `read_bytes`, and for bytes that are no such text.
    """
    data = read_bytes(path, max_bytes=max_bytes, allowed=allowed, error=error, remedy=remedy)
    return decoded_text(data, path, allowed=allowed, error=error, remedy=remedy)


def decoded_text(
    data: bytes,
    subject: str | Path,
    *,
    allowed: str,
    error: type[InputError] = InputError,
    remedy: str = "",
) -> str:
    """UTF-8 text, with or without a byte-order mark, or UTF-16.

    Parameters
    ----------
    data : bytes
        The text.
    subject : str or Path
        Where it is from, for the message.
    allowed, error, remedy
        As for `open_regular`.

    Returns
    -------
    str
        All of it, without the mark.

    Raises
    ------
    InputError
        Of the class `error`, for bytes that are no such text.
    """
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    if data[:1] and data[1:2] == data[3:4] == b"\0":  # Latin letters in UTF-16 without a mark
        encoding = "utf-16-le"
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as problem:
        found = f"byte {problem.start} is not {encoding.upper().removesuffix('-SIG')}"
        raise error.about(subject, found=found, allowed=allowed, remedy=remedy) from None


def bytes_text(count: int) -> str:
    """A number of bytes as people read it, with a decimal unit.

    Parameters
    ----------
    count : int
        Bytes.

    Returns
    -------
    str
        Four digits and a unit at most.
    """
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= size:
            return f"{count / size:.4g} {unit}"
    return f"{count} bytes"


def _why(path: Path, problem: OSError | ValueError) -> str:
    """Why a file could not be opened or read."""
    if isinstance(problem, FileNotFoundError):
        return "no such file"
    denied = isinstance(problem, PermissionError)  # so Windows calls it to open a folder
    if isinstance(problem, IsADirectoryError) or (denied and path.is_dir()):
        return "a folder"
    reason = problem.strerror if isinstance(problem, OSError) else str(problem)
    return f"cannot be read ({reason or 'unknown reason'})"


def is_file(path: Path) -> bool:
    """Whether a regular file has a name.

    Parameters
    ----------
    path : Path
        Any path.

    Returns
    -------
    bool
        False also for a name that no file can have.
    """
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
