"""The bytes of a regular file, read once its size is known to be allowed.

A name may lead to a pipe, a device or a folder; none of them is ever waited for or read.
"""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO, cast

from elocute.errors import InputError
from elocute.one_line_repr import brief

HOLES_FREE_BYTES, HOLES_TIMES = 1_000_000_000, 1000
"""A file may be a thousand times as long as what is stored of it, or this long."""
ANY_BYTES = 2**62
"""The budget of a file that is never in memory as a whole, but read piece by piece."""
_WITHOUT_WAITING = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)


@dataclass(frozen=True)
class FileKind:
    """What a file is read as: what is allowed, how large it may be, and how errors say so."""

    allowed: str  # what kind of file is wanted, for the message of an error
    max_bytes: int  # largest size of the file, bytes; it is checked before memory is taken
    error: type[InputError] = InputError  # the class to raise
    remedy: str = ""  # how to get such a file, for the message of an error

    def unusable(self, subject: str | Path, found: str) -> InputError:
        """The error about a file that is not of this kind."""
        return self.error.about(subject, found=found, allowed=self.allowed, remedy=self.remedy)


def path_of(name: object, error: type[InputError] = InputError) -> Path:
    """A path that a caller gave, as text or a path object; raises `error` for anything else."""
    if not isinstance(name, str | os.PathLike):
        raise error.about("path", found=brief(name), allowed="the name of a file or folder")
    try:
        return Path(name)
    except Exception:  # an object of the caller's that stands for bytes, a number or an error
        raise error.about("path", found=brief(name), allowed="a name as text") from None


def stored_bytes(file: BinaryIO) -> int:
    """Bytes of an unread file that are stored, where few are and the system tells; else its size.

    A few bytes can begin a file of a terabyte that is never there, and is read for hours.
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
def open_regular(path: str | Path, kind: FileKind) -> Iterator[BinaryIO]:
    """Open a regular file of limited size for reading; its size is checked on the open file.

    Raises the kind's error for a file that is missing, larger, a folder, a pipe or a device, or
    cannot be read; also for errors of the operating system inside the block.
    """
    path = path_of(path, kind.error)
    try:
        descriptor = os.open(path, os.O_RDONLY | _WITHOUT_WAITING)
    except (OSError, ValueError) as problem:
        raise kind.unusable(path, _why(path, problem)) from None
    facts = os.fstat(descriptor)
    if not stat.S_ISREG(facts.st_mode):
        os.close(descriptor)  # Python makes no file of a folder
        found = "a folder" if stat.S_ISDIR(facts.st_mode) else "no regular file"
        raise kind.unusable(path, found)
    with os.fdopen(descriptor, "rb") as file:
        if facts.st_size > kind.max_bytes:
            raise _too_large(path, bytes_text(facts.st_size), kind)
        stored = stored_bytes(file)
        if facts.st_size > max(HOLES_FREE_BYTES, HOLES_TIMES * stored):
            found = f"{bytes_text(facts.st_size)}, nearly all of it holes"
            raise replace(kind, remedy="copy it again").unusable(path, found)
        try:
            yield file
        except OSError as problem:
            raise kind.unusable(path, _why(path, problem)) from problem


def _too_large(path: Path, found: str, kind: FileKind) -> InputError:
    """The error about a file beyond its kind's budget."""
    allowed = f"{kind.allowed} of up to {bytes_text(kind.max_bytes)}"
    return kind.error.about(path, found=found, allowed=allowed)


def read_bytes(path: str | Path, kind: FileKind) -> bytes:
    """Read a regular file of limited size.

    Raises as `open_regular`, and for a file that grows meanwhile.
    """
    with open_regular(path, kind) as file:
        size = os.fstat(file.fileno()).st_size
        data = file.read(size + 1)  # asks for that much memory at once, so never for max_bytes
    if len(data) > size:  # it grew after its size was asked for
        raise _too_large(Path(path), "a growing file", kind)
    return data


def file_sha256(path: str | Path, error: type[InputError] = InputError) -> str:
    """SHA-256 of a regular file of any size, hexadecimal; `error` where it cannot be read."""
    with open_regular(path, FileKind("a file", ANY_BYTES, error)) as file:
        return hashlib.file_digest(cast(Any, file), "sha256").hexdigest()


def read_text(path: str | Path, kind: FileKind) -> str:
    """Read UTF-8 text, with or without a byte-order mark, or UTF-16 with one.

    Raises as `read_bytes`, and for bytes that are no such text.
    """
    return decoded_text(read_bytes(path, kind), path, kind)


def decoded_text(data: bytes, subject: str | Path, kind: FileKind) -> str:
    """UTF-8 text, with or without a byte-order mark, or UTF-16, without the mark.

    Raises the kind's error, about `subject`, for bytes that are no such text.
    """
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    if data[:1] and data[1:2] == data[3:4] == b"\0":  # Latin letters in UTF-16 without a mark
        encoding = "utf-16-le"
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as problem:
        found = f"byte {problem.start} is not {encoding.upper().removesuffix('-SIG')}"
        raise kind.unusable(subject, found) from None


def bytes_text(count: int) -> str:
    """A number of bytes as people read it: four digits at most and a decimal unit."""
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
    """Whether a regular file has a name; False also for a name that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
