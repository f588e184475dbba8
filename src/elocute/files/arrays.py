"""NumPy's .npy and .npz, read without pickle, with every size known before memory is taken.

NumPy's own reader trusts what a header says of shape and type, and unpacks an archive whatever
its size. Here the header is parsed as the plain literal that it is, the numbers that it promises
are held against the bytes that are there, and what an archive may unpack to is limited.
"""

from __future__ import annotations

import ast
import contextlib
import copy
import math
import os
import struct
import threading
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError
from elocute.files.atomic import write_atomically
from elocute.files.reading import bytes_text, open_regular

MAGIC = b"\x93NUMPY"
HEADER_MAX_BYTES = 10_000
AXES_MAX = 8
NUMBER_KINDS = "biuf"
TEXT_MAX_BYTES = 4_000_000
ENTRIES_MAX = 10_000
DIRECTORY_MAX_BYTES = 4_000_000
"""What zipfile may ask for at once to list the entries, each of which it makes an object."""
UNPACKED_TIMES = 100
"""An archive may unpack to this many times its own size …"""
UNPACKED_FREE_BYTES = 64_000_000
"""… or to this much, whichever is more."""

_SEEKING = threading.Lock()
_Packed = zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED


class _UnusableError(Exception):
    """Why an array is not read; becomes the caller's error with the file's name."""


@dataclass(frozen=True)
class ArrayHeader:
    """What stands before the numbers of a .npy file."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    by_columns: bool

    @property
    def nbytes(self) -> int:
        """Bytes that the numbers take."""
        return math.prod(self.shape) * self.dtype.itemsize


def read_npz(
    path: str | Path,
    *,
    max_bytes: int,
    allowed: str,
    error: type[InputError] = InputError,
    remedy: str = "",
    only: frozenset[str] | None = None,
) -> dict[str, NDArray[Any]]:
    """The arrays of an .npz by name: numbers, truth values or text, never objects.

    `only` limits what is unpacked to some names. Raises `error`, in one line, for a file that is
    missing, larger than `max_bytes`, unpacks to far more than its size, is damaged, or holds
    anything but arrays.
    """
    with (
        open_regular(
            path, max_bytes=max_bytes, allowed=allowed, error=error, remedy=remedy
        ) as file,
        _one_line(path, allowed, error, remedy),
        _archive(file) as archive,
    ):
        entries = archive.infolist()
        _check_entries(entries, os.fstat(file.fileno()).st_size)
        names = {entry.filename.removesuffix(".npy"): entry for entry in entries}
        chosen = {name: entry for name, entry in names.items() if only is None or name in only}
        return {name: _unpacked(archive, entry) for name, entry in chosen.items()}


def npz_names(
    path: str | Path,
    *,
    max_bytes: int,
    allowed: str,
    error: type[InputError] = InputError,
) -> frozenset[str]:
    """The names of the arrays in an .npz, of which none is read. Raises as `read_npz`."""
    with (
        open_regular(path, max_bytes=max_bytes, allowed=allowed, error=error) as file,
        _one_line(path, allowed, error, ""),
        _archive(file) as archive,
    ):
        return frozenset(name.removesuffix(".npy") for name in archive.namelist())


def write_npz(
    path: str | Path, arrays: Mapping[str, NDArray[Any]], *, compressed: bool = False
) -> None:
    """Write arrays by name, whole or not at all. Raises OutputError."""
    save = np.savez_compressed if compressed else np.savez
    with write_atomically(path) as draft, draft.open("wb") as file:
        save(file, **arrays)  # pyright: ignore[reportArgumentType]


def read_npy(
    path: str | Path,
    *,
    max_bytes: int,
    allowed: str,
    error: type[InputError] = InputError,
    remedy: str = "",
) -> NDArray[Any]:
    """The array of a .npy in memory. Raises `error` as `read_npz`."""
    with (
        open_regular(
            path, max_bytes=max_bytes, allowed=allowed, error=error, remedy=remedy
        ) as file,
        _one_line(path, allowed, error, remedy),
    ):
        header = read_header(file)
        _check_promise(file, header)
        return _numbers(file, header)


class RowWriter:
    """A .npy that grows row by row; its header is filled in at the end.

    Ordinary writes, not a memory map: a disk that is full is then an error, not the end of the
    program.
    """

    HEADER_BYTES = 256

    def __init__(self, path: str | Path, row: tuple[int, ...], dtype: str = "<f4") -> None:
        self._row, self._dtype = tuple(row), np.dtype(dtype)
        self._file = Path(path).open("wb")  # noqa: SIM115
        self.count = 0
        """Rows written so far."""
        try:
            self._file.write(b" " * self.HEADER_BYTES)
        except BaseException:
            self._file.close()
            raise

    def add(self, rows: Any) -> None:
        """Append (count, *row)."""
        array = np.ascontiguousarray(rows, self._dtype)
        if array.shape[1:] != self._row:
            raise ValueError(f"rows of shape {array.shape[1:]} where {self._row} is written")
        self._file.write(array.data if array.size else b"")
        self.count += len(array)

    def close(self) -> None:
        """Fill in the header of format 1.0."""
        shape = (self.count, *self._row)
        fields = {"descr": self._dtype.str, "fortran_order": False, "shape": shape}
        lead = MAGIC + b"\x01\x00" + struct.pack("<H", self.HEADER_BYTES - 10)
        with self._file:
            self._file.seek(0)
            self._file.write(lead + repr(fields).encode().ljust(self.HEADER_BYTES - 11) + b"\n")

    def __enter__(self) -> RowWriter:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is None:
            self.close()
        else:
            with contextlib.suppress(OSError):  # what made the block fail is told
                self._file.close()


def save_npy(path: str | Path, array: NDArray[Any]) -> None:
    """Write a .npy of rows where it is named. Raises OSError that says why, as NumPy's does not."""
    with RowWriter(path, array.shape[1:], array.dtype.newbyteorder("<").str) as rows:
        rows.add(array)


class ArrayFile:
    """A .npy on disk whose rows are read when they are asked for, by `array[…]` as a memory map.

    Unlike a memory map, a file that is cut short while it is open is an error that can be told,
    not the end of the program. Rows are copies; an index is a whole number, a slice or an array
    of whole numbers over the first axis.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        allowed: str,
        error: type[InputError] = InputError,
        remedy: str = "",
    ) -> None:
        self.path, self._allowed, self._error = Path(path), allowed, error
        with (
            open_regular(
                path, max_bytes=2**62, allowed=allowed, error=error, remedy=remedy
            ) as file,
            _one_line(path, allowed, error, remedy),
        ):
            self._header = read_header(file)
            self._start = file.tell()
            if not self._header.shape or self._header.by_columns:
                raise _UnusableError("no array of rows (C order)")
            _check_promise(file, self._header)
        self._opened = _Opened(self.path)

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the whole array."""
        return self._header.shape

    @property
    def dtype(self) -> np.dtype[Any]:
        """Of every number."""
        return self._header.dtype

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return len(self._header.shape)

    @property
    def nbytes(self) -> int:
        """Bytes that all numbers take."""
        return self._header.nbytes

    def __len__(self) -> int:
        return self._header.shape[0]

    def __getitem__(self, index: Any) -> NDArray[Any]:
        if isinstance(index, tuple):
            return self[index[0]][(slice(None), *index[1:]) if _many(index[0]) else index[1:]]
        if isinstance(index, slice):
            start, stop, step = index.indices(len(self))
            if step == 1:
                return self._rows(start, max(stop - start, 0))
            return self[np.arange(start, stop, step)]
        if _many(index):
            return self._chosen(np.asarray(index))
        place = int(index) + (len(self) if index < 0 else 0)
        if not 0 <= place < len(self):
            raise IndexError(f"row {index} of {len(self)}")
        return self._rows(place, 1)[0]

    def part(self, start: int, stop: int) -> ArrayFile:
        """Some rows as an ArrayFile of their own: nothing is read. Bounds are cut to the array."""
        start, stop, _ = slice(start, stop).indices(len(self))
        result = copy.copy(self)
        row_bytes = math.prod(self.shape[1:]) * self.dtype.itemsize
        result._start = self._start + start * row_bytes
        result._header = replace(self._header, shape=(max(stop - start, 0), *self.shape[1:]))
        return result

    def __iter__(self) -> Iterator[NDArray[Any]]:
        return (self[row] for row in range(len(self)))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        whole = self._rows(0, len(self))
        return whole if dtype is None else whole.astype(dtype, copy=False)

    def _chosen(self, places: NDArray[Any]) -> NDArray[Any]:
        """Rows in any order, those that follow one another in the file read at once."""
        if places.dtype == bool:
            places = np.flatnonzero(places)
        places = np.where(places < 0, places + len(self), places)
        if len(places) and not (places.min() >= 0 and places.max() < len(self)):
            raise IndexError(f"rows {places.min()} to {places.max()} of {len(self)}")
        result = np.empty((len(places), *self.shape[1:]), self.dtype)
        breaks = np.flatnonzero(np.diff(places) != 1) + 1
        ends = [*breaks.tolist(), len(places)] if len(places) else []
        start = 0
        for end in ends:
            self._read_into(result[start:end], int(places[start]))
            start = end
        return result

    def _rows(self, start: int, count: int) -> NDArray[Any]:
        result = np.empty((count, *self.shape[1:]), self.dtype)
        self._read_into(result, start)
        return result

    def _read_into(self, rows: NDArray[Any], first: int) -> None:
        """Fill rows with those of the file from `first` on."""
        row_bytes = math.prod(self.shape[1:]) * self.dtype.itemsize
        try:
            if not _filled_from(self._opened.file, rows, self._start + first * row_bytes):
                raise self._error.about(
                    self.path, found="cut short while it was read", allowed=self._allowed
                )
        except OSError as problem:
            raise self._error.about(
                self.path, found=f"cannot be read ({problem.strerror})", allowed=self._allowed
            ) from problem


class _Opened:
    """A file that is opened when it is first read, shared by an ArrayFile and its parts."""

    def __init__(self, path: Path) -> None:
        self._path = path

    @cached_property
    def file(self) -> BinaryIO:
        return self._path.open("rb", buffering=0)

    def __getstate__(self) -> dict[str, Any]:
        """An open file does not travel to another process."""
        return {"_path": self._path}

    def __del__(self) -> None:
        if "file" in self.__dict__:
            self.file.close()


def read_header(file: Any) -> ArrayHeader:
    """Parse the header of a .npy at the place where `file` stands.

    Raises ValueError (here: its kind that `read_npz` and `read_npy` report).
    """
    start = file.read(len(MAGIC) + 2)
    if start[: len(MAGIC)] != MAGIC or len(start) < len(MAGIC) + 2:
        raise _UnusableError("no NumPy array")
    major = start[len(MAGIC)]
    if major not in (1, 2, 3):
        raise _UnusableError(f"a NumPy array of format version {major}")
    size_bytes = file.read(2 if major == 1 else 4)
    if len(size_bytes) < (2 if major == 1 else 4):
        raise _UnusableError("a header that ends early")
    (size,) = struct.unpack("<H" if major == 1 else "<I", size_bytes)
    if size > HEADER_MAX_BYTES:
        raise _UnusableError(f"a header of {size} bytes")
    text = file.read(size)
    if len(text) < size:
        raise _UnusableError("a header that ends early")
    return _parsed(text.decode("utf-8" if major == 3 else "latin-1", "replace"))


def _parsed(text: str) -> ArrayHeader:
    if "\\" in text:  # never in what NumPy writes, and Python would warn of some
        raise _UnusableError("a header that cannot be read")
    try:
        fields = ast.literal_eval(text.strip())
    except (ValueError, SyntaxError, MemoryError, RecursionError, TypeError):
        raise _UnusableError("a header that cannot be read") from None
    if not isinstance(fields, dict) or set(fields) != {"descr", "fortran_order", "shape"}:
        raise _UnusableError("a header without descr, fortran_order and shape")
    shape, described = fields["shape"], fields["descr"]
    if (
        not isinstance(shape, tuple)
        or len(shape) > AXES_MAX
        or not all(type(size) is int and 0 <= size < 2**40 for size in shape)
    ):
        raise _UnusableError("a shape that is none")
    if not isinstance(described, str) or len(described) > 16:
        raise _UnusableError("numbers of no plain type")
    try:
        dtype = np.dtype(described)
    except (TypeError, ValueError):
        raise _UnusableError(f"numbers of type {described!r}") from None
    if dtype.kind == "O":
        raise _UnusableError("an array of Python objects (type '|O')")
    text_like = dtype.kind in "SU" and dtype.itemsize <= TEXT_MAX_BYTES
    if not (dtype.kind in NUMBER_KINDS or text_like) or dtype.itemsize == 0:
        raise _UnusableError(f"numbers of type {described!r}")
    return ArrayHeader(shape, dtype, fields["fortran_order"] is True)


def _check_promise(file: BinaryIO, header: ArrayHeader) -> None:
    left = os.fstat(file.fileno()).st_size - file.tell()
    if header.nbytes > left:
        raise _UnusableError(f"{bytes_text(left)} of the {bytes_text(header.nbytes)} promised")


def _numbers(file: Any, header: ArrayHeader) -> NDArray[Any]:
    """What stands after a header whose promise is known to be kept."""
    flat = np.empty(math.prod(header.shape), header.dtype)
    if not _filled(file, flat):
        raise _UnusableError("numbers that end early")
    if header.dtype.kind == "b":
        # A truth value of another byte than 0 or 1 behaves unpredictably later.
        flat = flat.view(np.uint8) != 0
    shaped = flat.reshape(header.shape, order="F" if header.by_columns else "C")
    return shaped.astype(shaped.dtype.newbyteorder("="), copy=False)


def _filled(file: Any, array: NDArray[Any]) -> bool:
    """Read into an array until it is full; False where the file ends before."""
    view, done = array.reshape(-1).view(np.uint8).data, 0
    while done < len(view):
        got = file.readinto(view[done:])
        if not got:
            return False
        done += got
    return True


def _filled_from(file: Any, array: NDArray[Any], place: int) -> bool:
    """As `_filled`, from a place in a file: threads and forked processes share its position."""
    if not array.size:
        return True
    if not hasattr(os, "preadv"):  # Windows
        with _SEEKING:
            file.seek(place)
            return _filled(file, array)
    view, done = array.reshape(-1).view(np.uint8).data, 0
    while done < len(view):
        got = os.preadv(file.fileno(), [view[done:]], place + done)
        if not got:
            return False
        done += got
    return True


def _archive(file: BinaryIO) -> zipfile.ZipFile:
    """An archive whose directory is of limited size. Raises what zipfile raises."""
    limited = _Limited(file)
    archive = zipfile.ZipFile(cast(Any, limited))
    limited.most = None
    return archive


class _Limited:
    """A file that gives at most so much at once: zipfile asks for the whole directory first."""

    most: int | None = DIRECTORY_MAX_BYTES

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.seek, self.tell = file.seek, file.tell

    def read(self, size: int = -1) -> bytes:
        if self.most is None:
            return self._file.read(size)
        if size > self.most:
            raise _UnusableError(f"more than {ENTRIES_MAX} arrays")
        return self._file.read(self.most if size < 0 else size)

    def seekable(self) -> bool:
        return True


def _check_entries(entries: list[zipfile.ZipInfo], packed: int) -> None:
    if len(entries) > ENTRIES_MAX:
        raise _UnusableError(f"{len(entries)} arrays")
    if len({entry.filename for entry in entries}) != len(entries):
        raise _UnusableError("an array twice")
    limit = max(UNPACKED_FREE_BYTES, UNPACKED_TIMES * packed)
    total = sum(entry.file_size for entry in entries)
    if total > limit:
        raise _UnusableError(
            f"{bytes_text(total)} inside, which is more than the {bytes_text(limit)} that a file "
            f"of its size may hold"
        )
    for entry in entries:
        if entry.compress_type not in _Packed or entry.flag_bits & 1:
            raise _UnusableError("an array that is packed another way than NumPy does")


def _unpacked(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> NDArray[Any]:
    name = entry.filename.removesuffix(".npy")[:80]
    with archive.open(entry) as file:
        try:
            header = read_header(file)
            if header.nbytes > entry.file_size:
                raise _UnusableError("numbers that end early")
            return _numbers(file, header)
        except _UnusableError as problem:
            raise _UnusableError(f"{problem} under the name {name!r}") from None


def _many(index: Any) -> bool:
    return isinstance(index, slice | list | np.ndarray)


@contextmanager
def _one_line(
    path: str | Path, allowed: str, error: type[InputError], remedy: str
) -> Iterator[None]:
    """Whatever a damaged archive makes the standard library raise is one line of `error`."""
    try:
        yield
    except _UnusableError as problem:
        raise error.about(path, found=str(problem), allowed=allowed, remedy=remedy) from None
    except (
        zipfile.BadZipFile,
        zipfile.LargeZipFile,
        zlib.error,
        EOFError,
        ValueError,
        KeyError,
        NotImplementedError,
        RuntimeError,
        struct.error,
        OverflowError,
        UnicodeError,
        IndexError,
    ) as problem:
        if isinstance(problem, InputError):
            raise
        reason = " ".join(str(problem).split())[:120]
        raise error.about(
            path, found=f"damaged, or something else ({reason})", allowed=allowed, remedy=remedy
        ) from None
