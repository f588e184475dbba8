"""Arrays and sparse matrices made of a pickle's parts, once these are known to fit."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.files.pickles.pickle_budget import ARRAY_BYTES, MemoryBudget, RefusedError
from elocute.files.pickles.pickle_cursor import RawString
from elocute.one_line_repr import one_line

DTYPES = ("b1", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f2", "f4", "f8")
AXES_MAX = 32
AXIS_MAX = 2**40


@dataclass(frozen=True, eq=False)
class SparseMatrix:
    """A matrix as scipy stores it by columns ("csc") or by rows ("csr"), checked."""

    layout: str  # "csc" or "csr"
    data: NDArray[Any]  # (entry,) numbers
    indices: NDArray[Any]  # (entry,) row (csc) or column (csr) of each
    indptr: NDArray[Any]  # (columns + 1,) where each column or row begins
    shape: tuple[int, int]  # rows and columns

    @property
    def nbytes(self) -> int:
        """Bytes of the three arrays."""
        return self.data.nbytes + self.indices.nbytes + self.indptr.nbytes

    __repr__ = one_line

    def dense(self) -> NDArray[np.float64]:
        """The matrix with its zeros; entries that occur twice are added.

        Returns
        -------
        (row, column) float64
            As large as `shape` says.
        """
        lines, across = self.shape if self.layout == "csr" else self.shape[::-1]
        line = np.repeat(np.arange(lines), np.diff(self.indptr.astype(np.int64)))
        result = np.zeros((lines, across))
        np.add.at(result, (line, self.indices), self.data)
        return result if self.layout == "csr" else np.ascontiguousarray(result.T)


def dtype_with_order(dtype: np.dtype, state: Any) -> np.dtype:
    """A dtype with the byte order of its state; fields and the like are refused."""
    parts = state[1:5] if isinstance(state, tuple) else ()
    order = parts[0] if len(parts) == 4 else None
    if not isinstance(order, str) or len(order) != 1 or order not in "<>|=":
        raise RefusedError("an array type of no byte order", "< > | =")
    if any(part is not None for part in parts[1:]):
        raise RefusedError("an array type with fields", f"numbers: {' '.join(DTYPES)}")
    return dtype if order == "|" else dtype.newbyteorder(order)  # pyright: ignore


def array_over_bytes(
    raw: Any, dtype: Any, shape: Any, order: str, budget: MemoryBudget
) -> NDArray[Any]:
    """A read-only array over bytes of the file, once they are known to be as many as it needs."""
    if not isinstance(dtype, np.dtype):
        raise RefusedError("an array without a type", f"numbers: {' '.join(DTYPES)}")
    axes = isinstance(shape, tuple) and len(shape) <= AXES_MAX
    if not axes or not all(_whole(n) and 0 <= n <= AXIS_MAX for n in shape):
        raise RefusedError(f"an array of shape {_shape_text(shape)}", "whole numbers")
    budget.spend(ARRAY_BYTES)
    data, needed = bytes_of(raw, budget), math.prod(shape) * dtype.itemsize
    if len(data) != needed:
        raise RefusedError(
            f"an array of shape {_shape_text(shape)} and {dtype} over {len(data)} bytes",
            f"{needed}",
        )
    if dtype.kind == "b" and needed:
        budget.spend(needed)  # looked through, which a file may not ask for without end
        if np.frombuffer(data, np.uint8).max() > 1:
            raise RefusedError("an array of truth values other than 0 and 1", "0 and 1")
    try:
        return np.frombuffer(data, dtype).reshape(shape, order=order)  # pyright: ignore
    except ValueError as error:
        raise RefusedError(f"an array of shape {_shape_text(shape)}", "whole numbers") from error


def array_of_state(state: Any, budget: MemoryBudget) -> NDArray[Any]:
    """An array of NumPy's state: (version,) shape, dtype, by columns or not, bytes."""
    if not isinstance(state, tuple) or len(state) not in (4, 5):
        raise RefusedError("an array without its state")
    shape, dtype, fortran, raw = state[-4:]
    by_columns = isinstance(fortran, int) and fortran != 0
    return array_over_bytes(raw, dtype, shape, "F" if by_columns else "C", budget)


def array_of_chumpy(state: dict[Any, Any], budget: MemoryBudget) -> NDArray[Any]:
    """A chumpy object is the array that it was made from: its derivatives are of no use here."""
    return _needed(state, "x", "chumpy object")


def array_of_select(state: dict[Any, Any], budget: MemoryBudget) -> NDArray[Any]:
    """chumpy's Select: `a.ravel()[idxs].reshape(preferred_shape)`."""
    whole_source = _needed(state, "a", "chumpy selection")
    chosen = _needed(state, "idxs", "chumpy selection")
    budget.spend(ARRAY_BYTES + whole_source.nbytes + chosen.nbytes)
    budget.spend(chosen.size * (8 + whole_source.itemsize))
    source, chosen = whole_source.ravel(), chosen.ravel()
    if chosen.dtype.kind not in "iu" or (
        chosen.size and not 0 <= int(chosen.min()) <= int(chosen.max()) < source.size
    ):
        raise RefusedError("a chumpy selection of what is not there", "indices into its array")
    shape = state.get("preferred_shape", (chosen.size,))
    axes = isinstance(shape, tuple) and len(shape) <= AXES_MAX
    if (
        not axes
        or not all(_whole(n) and 0 <= n <= AXIS_MAX for n in shape)
        or math.prod(shape) != chosen.size
    ):
        raise RefusedError(f"a chumpy selection of shape {_shape_text(shape)}", "one that it fills")
    return source[chosen].reshape(shape)


def sparse_of_state(layout: str) -> Callable[[dict[Any, Any], MemoryBudget], SparseMatrix]:
    """A function that makes a matrix of a layout ("csc" or "csr") of scipy's state."""

    def fill_sparse(state: dict[Any, Any], budget: MemoryBudget) -> SparseMatrix:
        name = f"{layout} matrix"
        data, indices, indptr = (_needed(state, key, name) for key in ("data", "indices", "indptr"))
        shape = state.get("_shape", state.get("shape"))
        pair = shape if isinstance(shape, tuple) and len(shape) == 2 else ()
        if not pair or not all(_whole(n) and 0 <= n < 2**31 for n in pair):
            raise RefusedError(f"a {name} of shape {_shape_text(shape)}", "two whole numbers")
        budget.spend(ARRAY_BYTES + data.nbytes + indices.nbytes + 24 * indptr.size)
        lines, across = pair if layout == "csr" else pair[::-1]
        _check_sparse(name, data, indices, indptr, lines, across)
        return SparseMatrix(layout, data, indices, indptr, pair)

    return fill_sparse


def _check_sparse(
    name: str,
    data: NDArray[Any],
    indices: NDArray[Any],
    indptr: NDArray[Any],
    lines: int,
    across: int,
) -> None:
    """Raise RefusedError where the parts do not make a matrix."""
    if data.ndim != 1 or indices.shape != data.shape or indptr.shape != (lines + 1,):
        raise RefusedError(
            f"a {name} whose parts do not fit", "data, indices and indptr of one matrix"
        )
    if indices.dtype.kind not in "iu" or indptr.dtype.kind not in "iu":
        raise RefusedError(f"a {name} with indices that are no whole numbers", "whole numbers")
    starts = indptr.astype(np.int64)
    if starts[0] != 0 or starts[-1] != len(data) or (np.diff(starts) < 0).any():
        raise RefusedError(f"a {name} whose indptr does not rise from 0 to {len(data)}")
    if len(indices) and not 0 <= int(indices.min()) <= int(indices.max()) < across:
        raise RefusedError(f"a {name} with an index outside 0…{across - 1}")


def _needed(state: dict[Any, Any], key: str, name: str) -> NDArray[Any]:
    """An array of a state; raises RefusedError for anything else."""
    value = state.get(key)
    if not isinstance(value, np.ndarray):
        raise RefusedError(f"a {name} without an array {key!r}", "an array")
    return value


def bytes_of(raw: Any, budget: MemoryBudget) -> memoryview | bytes:
    """The bytes behind a string of either Python."""
    if isinstance(raw, RawString):
        return raw.view
    if isinstance(raw, bytes):
        return raw
    if isinstance(raw, str):
        budget.spend(len(raw))
        try:
            return raw.encode("latin-1")
        except UnicodeEncodeError as error:
            raise RefusedError("array data that are not bytes") from error
    raise RefusedError(f"array data that are a {type(raw).__name__}", "bytes")


def _shape_text(shape: Any) -> str:
    """A shape in a message; what is not one may be of any depth and is not shown."""
    if isinstance(shape, tuple) and len(shape) <= AXES_MAX and all(map(_whole, shape)):
        return str(shape)
    return f"that is a {type(shape).__name__}"


def _whole(value: Any) -> bool:
    """Whether a value is a whole number."""
    return isinstance(value, int) and not isinstance(value, bool)
