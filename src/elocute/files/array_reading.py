"""Reading .npy and .npz into memory, without pickle and with every size known beforehand."""

from __future__ import annotations

import math
import os
import zipfile
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from elocute.files.npy_header import (
    NpyHeader,
    UnusableArrayError,
    array_errors,
    check_size,
    read_npy_header,
)
from elocute.files.reading import FileKind, bytes_text, open_regular
from elocute.files.unpacked_size import unpacked_limit

ENTRIES_MAX = 10_000
DIRECTORY_MAX_BYTES = 4_000_000
"""What zipfile may ask for at once to list the entries, each of which it makes an object."""
COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def read_npy(path: str | Path, kind: FileKind) -> NDArray[Any]:
    """Read the array of a .npy into memory, in the machine's byte order.

    Raises the kind's error for a file that is missing, larger, damaged, or holds anything but
    numbers, truth values or text.
    """
    with open_regular(path, kind) as file, array_errors(path, kind):
        header = read_npy_header(file)
        check_size(file, header)
        return _numbers(file, header)


def read_npz(
    path: str | Path, kind: FileKind, only: frozenset[str] | None = None
) -> dict[str, NDArray[Any]]:
    """Read the arrays of an .npz into memory, all or `only` some, by name.

    They are numbers, truth values or text, never objects. Raises the kind's error for a file that
    is missing, larger, damaged, unpacks to far more than its size, or holds anything but arrays.
    """
    with open_regular(path, kind) as file, array_errors(path, kind), _archive(file) as archive:
        entries = archive.infolist()
        _check_entries(entries, os.fstat(file.fileno()).st_size)
        names = {entry.filename.removesuffix(".npy"): entry for entry in entries}
        chosen = {name: entry for name, entry in names.items() if only is None or name in only}
        return {name: _unpacked(archive, entry) for name, entry in chosen.items()}


def npz_names(path: str | Path, kind: FileKind) -> frozenset[str]:
    """The names of the arrays in an .npz, of which none is read.

    Raises the kind's error for a file that is missing, larger or no archive.
    """
    with open_regular(path, kind) as file, array_errors(path, kind), _archive(file) as archive:
        return frozenset(name.removesuffix(".npy") for name in archive.namelist())


def fill_array(file: Any, array: NDArray[Any]) -> bool:
    """Fill a contiguous array from where a file stands; False where the file ends before."""
    view, done = array.reshape(-1).view(np.uint8).data, 0
    while done < len(view):
        got = file.readinto(view[done:])
        if not got:
            return False
        done += got
    return True


def _numbers(file: Any, header: NpyHeader) -> NDArray[Any]:
    """The numbers behind a header whose size was checked."""
    flat = np.empty(math.prod(header.shape), header.dtype)
    if not fill_array(file, flat):
        raise UnusableArrayError("numbers that end early")
    if header.dtype.kind == "b":
        # A truth value of another byte than 0 or 1 behaves unpredictably later.
        flat = flat.view(np.uint8) != 0
    if header.dtype.kind == "f" and header.dtype.itemsize > 8:
        # Not every pattern of bits is a number of ten bytes: what is none becomes NaN.
        with np.errstate(all="ignore"):
            flat = flat.astype(np.float64)
    shaped = flat.reshape(header.shape, order="F" if header.by_columns else "C")
    return shaped.astype(shaped.dtype.newbyteorder("="), copy=False)


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
            raise UnusableArrayError(f"more than {ENTRIES_MAX} arrays")
        return self._file.read(self.most if size < 0 else size)

    def seekable(self) -> bool:
        return True


def _check_entries(entries: list[zipfile.ZipInfo], packed_bytes: int) -> None:
    """Refuse an archive that NumPy did not write or that unpacks to too much."""
    if len(entries) > ENTRIES_MAX:
        raise UnusableArrayError(f"{len(entries)} arrays")
    if len({entry.filename for entry in entries}) != len(entries):
        raise UnusableArrayError("an array twice")
    limit = unpacked_limit(packed_bytes)
    total = sum(entry.file_size for entry in entries)
    if total > limit:
        raise UnusableArrayError(
            f"{bytes_text(total)} inside, which is more than the {bytes_text(limit)} that a file "
            f"of its size may hold"
        )
    for entry in entries:
        if entry.compress_type not in COMPRESSIONS or entry.flag_bits & 1:
            raise UnusableArrayError("an array that is packed another way than NumPy does")


def _unpacked(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> NDArray[Any]:
    """One array of an archive."""
    name = entry.filename.removesuffix(".npy")[:80]
    with archive.open(entry) as file:
        try:
            header = read_npy_header(file)
            if header.nbytes > entry.file_size:
                raise UnusableArrayError("numbers that end early")
            return _numbers(file, header)
        except UnusableArrayError as problem:
            raise UnusableArrayError(f"{problem} under the name {name!r}") from None
