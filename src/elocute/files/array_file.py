"""ArrayFile: a .npy on disk whose rows are read when they are asked for."""

from __future__ import annotations

import copy
import math
import os
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from elocute.files.array_reading import fill_array
from elocute.files.npy_header import UnusableArrayError, array_errors, check_size, read_npy_header
from elocute.files.reading import FileKind, open_regular

_SEEKING = threading.Lock()


class ArrayFile:
    """A .npy on disk, indexed like a memory map by `array[…]`; rows are copies.

    Unlike with a memory map, a file that is cut short while it is open is an error, not the end
    of the program. An index is a whole number, a slice, or an array of whole numbers or truth
    values over the first axis; further axes may follow.

    Parameters
    ----------
    path : str or Path
        The file, of one axis or more; row after row is read fastest.
    kind : FileKind
        What it may be; of any size (`ANY_BYTES`), as little of it is read at once.

    Raises
    ------
    InputError
        Of the kind's class, for a file that is missing, damaged or something else; also when
        rows are read and the file has been cut short.
    """

    def __init__(self, path: str | Path, kind: FileKind) -> None:
        self.path, self._kind = Path(path), kind
        with open_regular(path, kind) as file, array_errors(path, kind):
            self._header = read_npy_header(file)
            self._start = file.tell()
            if not self._header.shape:
                raise UnusableArrayError("a single number")
            check_size(file, self._header)
        self._column_bytes = len(self) * self.dtype.itemsize
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
        """The rows of a slice as an ArrayFile of their own, a view of the file; nothing is read."""
        start, stop, _ = slice(start, stop).indices(len(self))
        result = copy.copy(self)
        step = self.dtype.itemsize if self._header.by_columns else self._row_bytes
        result._start = self._start + start * step
        result._header = replace(self._header, shape=(max(stop - start, 0), *self.shape[1:]))
        return result

    def __iter__(self) -> Iterator[NDArray[Any]]:
        return (self[row] for row in range(len(self)))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        whole = self._rows(0, len(self))
        return whole if dtype is None else whole.astype(dtype, copy=False)

    @property
    def _row_bytes(self) -> int:
        """Bytes of one row."""
        return math.prod(self.shape[1:]) * self.dtype.itemsize

    def _chosen(self, places: NDArray[Any]) -> NDArray[Any]:
        """Rows in any order; those that follow one another in the file are read at once."""
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
        """`count` rows from `start` on."""
        result = np.empty((count, *self.shape[1:]), self.dtype)
        self._read_into(result, start)
        return result

    def _read_into(self, rows: NDArray[Any], first: int) -> None:
        """Fill rows with those of the file from `first` on."""
        try:
            if not self._filled(rows, first):
                raise self._kind.unusable(self.path, "cut short while it was read")
        except OSError as problem:
            found = f"cannot be read ({problem.strerror})"
            raise self._kind.unusable(self.path, found) from problem

    def _filled(self, rows: NDArray[Any], first: int) -> bool:
        """False where the file ends early."""
        file = self._opened.file
        if not self._header.by_columns:
            return _fill_from(file, rows, self._start + first * self._row_bytes)
        columns = np.empty((math.prod(self.shape[1:]), len(rows)), self.dtype)
        start = self._start + first * self.dtype.itemsize
        for number, column in enumerate(columns):
            if not _fill_from(file, column, start + number * self._column_bytes):
                return False
        rows[:] = columns.reshape(*self.shape[:0:-1], len(rows)).transpose()
        return True


class _Opened:
    """A file that is opened when it is first read, shared by an ArrayFile and its parts."""

    def __init__(self, path: Path) -> None:
        self._path, self._lock = path, threading.Lock()
        self._file: BinaryIO | None = None

    @property
    def file(self) -> BinaryIO:
        """Unbuffered; opened once, whichever thread asks first."""
        with self._lock:
            if self._file is None:
                self._file = self._path.open("rb", buffering=0)
            return self._file

    def __reduce__(self) -> tuple[Any, ...]:
        """The path alone: an open file cannot be sent to another process."""
        return _Opened, (self._path,)

    def __del__(self) -> None:
        if self._file is not None:
            self._file.close()


def _fill_from(file: Any, array: NDArray[Any], place: int) -> bool:
    """As `fill_array`, from a place in a file whose position threads and processes share."""
    if not array.size:
        return True
    if not hasattr(os, "preadv"):  # Windows
        with _SEEKING:
            file.seek(place)
            return fill_array(file, array)
    view, done = array.reshape(-1).view(np.uint8).data, 0
    while done < len(view):
        got = os.preadv(file.fileno(), [view[done:]], place + done)
        if not got:
            return False
        done += got
    return True


def _many(index: Any) -> bool:
    """Whether an index stands for several rows."""
    return isinstance(index, slice | list | np.ndarray)
