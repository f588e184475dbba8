"""Writing .npz whole or not at all, and .npy row by row, by ordinary writes.

No memory map: a full disk is then an error and not the end of the program.
"""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.files.atomic import write_atomically
from elocute.files.npy_header import MAGIC


def write_npz(
    path: str | Path, arrays: Mapping[str, NDArray[Any]], *, compressed: bool = False
) -> None:
    """Write arrays by name to an .npz, whole or not at all, deflated where `compressed`.

    Raises OutputError where the file cannot be written.
    """
    save = np.savez_compressed if compressed else np.savez
    with write_atomically(path) as draft, draft.open("wb") as file:
        save(file, **arrays)  # pyright: ignore[reportArgumentType]


class RowWriter:
    """A .npy that grows row by row; its header (format 1.0) is filled in when it is closed.

    Parameters
    ----------
    path : str or Path
        The file.
    row : tuple of int
        Shape of one row, () for numbers.
    dtype : str
        Type of the numbers as NumPy describes it, with its byte order.

    Raises
    ------
    OSError
        Where the file cannot be written, by any method.
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
        """Append rows.

        Parameters
        ----------
        rows : (count, ...) array_like
            Converted to the file's type.

        Raises
        ------
        ValueError
            For rows of another shape.
        """
        array = np.ascontiguousarray(rows, self._dtype)
        if array.shape[1:] != self._row:
            raise ValueError(f"rows of shape {array.shape[1:]} where {self._row} is written")
        self._file.write(array.data if array.size else b"")
        self.count += len(array)

    def close(self) -> None:
        """Write the header and close the file."""
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
            with contextlib.suppress(OSError):  # what made the block fail is reported instead
                self._file.close()


def save_npy(path: str | Path, array: NDArray[Any]) -> None:
    """Write a .npy directly under its name.

    Parameters
    ----------
    path : str or Path
        The file.
    array : (row, …)
        Of one axis or more.

    Raises
    ------
    OSError
        With its reason, which NumPy's own writer leaves out.
    """
    with RowWriter(path, array.shape[1:], array.dtype.newbyteorder("<").str) as rows:
        rows.add(array)
