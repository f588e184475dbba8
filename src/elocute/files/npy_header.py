"""The header of a .npy, parsed as a plain literal and checked before memory is taken.

NumPy's own reader trusts what a header says of shape and type. Here the header is parsed without
running anything, and the size that it promises is compared with the bytes that are there.
"""

from __future__ import annotations

import ast
import math
import os
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from elocute.errors import InputError
from elocute.files.reading import FileKind, bytes_text

MAGIC = b"\x93NUMPY"
HEADER_MAX_BYTES = 10_000
AXES_MAX = 8
AXIS_MAX = 2**40
NUMBER_KINDS = "biuf"
TEXT_MAX_BYTES = 4_000_000


class UnusableArrayError(Exception):
    """Why an array is not read; `array_errors` makes it the caller's error with the file's name."""


@dataclass(frozen=True)
class NpyHeader:
    """What a .npy says of its numbers."""

    shape: tuple[int, ...]  # length of each axis
    dtype: np.dtype[Any]  # type of every number, with its byte order
    by_columns: bool  # whether the first axis varies fastest (Fortran order)

    @property
    def nbytes(self) -> int:
        """Bytes that the numbers take."""
        return math.prod(self.shape) * self.dtype.itemsize


def read_npy_header(file: Any) -> NpyHeader:
    """Parse the header of a .npy from where a file stands, up to the first number.

    Raises UnusableArrayError for anything but a header of numbers, truth values or text.
    """
    start = file.read(len(MAGIC) + 2)
    if start[: len(MAGIC)] != MAGIC or len(start) < len(MAGIC) + 2:
        lfs = start == b"version "
        raise UnusableArrayError("a pointer of Git LFS: git lfs pull" if lfs else "no NumPy array")
    major = start[len(MAGIC)]
    if major not in (1, 2, 3):
        raise UnusableArrayError(f"a NumPy array of format version {major}")
    size_bytes = file.read(2 if major == 1 else 4)
    if len(size_bytes) < (2 if major == 1 else 4):
        raise UnusableArrayError("a header that ends early")
    (size,) = struct.unpack("<H" if major == 1 else "<I", size_bytes)
    if size > HEADER_MAX_BYTES:
        raise UnusableArrayError(f"a header of {size} bytes")
    text = file.read(size)
    if len(text) < size:
        raise UnusableArrayError("a header that ends early")
    return _parsed(text.decode("utf-8" if major == 3 else "latin-1", "replace"))


def check_size(file: BinaryIO, header: NpyHeader) -> None:
    """Raise UnusableArrayError where a file holds fewer bytes than its header promises.

    The file is one of the operating system, just behind its header.
    """
    left = os.fstat(file.fileno()).st_size - file.tell()
    if header.nbytes > left:
        raise UnusableArrayError(f"{bytes_text(left)} of the {bytes_text(header.nbytes)} promised")


@contextmanager
def array_errors(path: str | Path, kind: FileKind) -> Iterator[None]:
    """Turn whatever a damaged file makes the standard library raise into the kind's error."""
    try:
        yield
    except UnusableArrayError as problem:
        raise kind.unusable(path, str(problem)) from None
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
        raise kind.unusable(path, f"damaged, or something else ({reason})") from None


def _parsed(text: str) -> NpyHeader:
    """The header in its text, a literal of a dict with three entries."""
    if "\\" in text:  # never in what NumPy writes, and Python would warn of some
        raise UnusableArrayError("a header that cannot be read")
    try:
        fields = ast.literal_eval(text.strip())
    except (ValueError, SyntaxError, MemoryError, RecursionError, TypeError):
        raise UnusableArrayError("a header that cannot be read") from None
    if not isinstance(fields, dict) or set(fields) != {"descr", "fortran_order", "shape"}:
        raise UnusableArrayError("a header without descr, fortran_order and shape")
    shape = fields["shape"]
    if (
        not isinstance(shape, tuple)
        or len(shape) > AXES_MAX
        or not all(type(size) is int and 0 <= size < AXIS_MAX for size in shape)
    ):
        raise UnusableArrayError("a shape that is none")
    return NpyHeader(shape, _plain_dtype(fields["descr"]), fields["fortran_order"] is True)


def _plain_dtype(described: Any) -> np.dtype[Any]:
    """The type that a header describes, where it is one of numbers, truth values or text."""
    if not isinstance(described, str) or len(described) > 16:
        raise UnusableArrayError("numbers of no plain type")
    if not re.fullmatch(r"[<>|=]?[A-Za-z?]+\d*", described):  # NumPy reads lists of types too
        raise UnusableArrayError(f"numbers of type {described!r}")
    try:
        dtype = np.dtype(described)
    except (TypeError, ValueError):
        raise UnusableArrayError(f"numbers of type {described!r}") from None
    if dtype.kind == "O":
        raise UnusableArrayError("an array of Python objects (type '|O')")
    text_like = dtype.kind in "SU" and dtype.itemsize <= TEXT_MAX_BYTES
    if not (dtype.kind in NUMBER_KINDS or text_like) or dtype.itemsize == 0:
        raise UnusableArrayError(f"numbers of type {described!r}")
    return dtype
