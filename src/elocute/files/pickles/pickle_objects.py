"""The few objects that a closed pickle may hold, made by our own code after looking at them.

No global of a file is ever imported or called: each name stands for one of the makers here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.files.pickles.pickle_arrays import (
    DTYPES,
    array_of_chumpy,
    array_of_select,
    array_of_state,
    array_over_bytes,
    bytes_of,
    dtype_with_order,
    sparse_of_state,
)
from elocute.files.pickles.pickle_budget import (
    CONTAINER_BYTES,
    ENTRY_BYTES,
    MemoryBudget,
    RefusedError,
)
from elocute.files.pickles.pickle_cursor import RawString, printable_start

_NUMPY_CORES = ("numpy.core", "numpy._core")
_BUILTINS = ("__builtin__", "builtins")
# (module, name): what it stands for.
GLOBALS: dict[tuple[str, str], str] = {
    ("chumpy.ch", "Ch"): "chumpy",
    ("chumpy.reordering", "Select"): "select",
    **{(f"{core}.multiarray", "_reconstruct"): "reconstruct" for core in _NUMPY_CORES},
    **{(f"{core}.multiarray", "scalar"): "scalar" for core in _NUMPY_CORES},
    **{(f"{core}.numeric", "_frombuffer"): "frombuffer" for core in _NUMPY_CORES},
    ("numpy", "ndarray"): "ndarray",
    ("numpy", "dtype"): "dtype",
    ("scipy.sparse.csc", "csc_matrix"): "csc",
    ("scipy.sparse._csc", "csc_matrix"): "csc",
    ("scipy.sparse.csr", "csr_matrix"): "csr",
    ("scipy.sparse._csr", "csr_matrix"): "csr",
    ("collections", "OrderedDict"): "dict",
    **{(module, "set"): "set" for module in _BUILTINS},
    **{(module, "object"): "object" for module in _BUILTINS},
    **{(module, "bytes"): "bytes" for module in _BUILTINS},
    ("copy_reg", "_reconstructor"): "reconstructor",
    ("copyreg", "_reconstructor"): "reconstructor",
    ("_codecs", "encode"): "encode",
}
ALLOWED = ", ".join(f"{module}.{name}" for module, name in GLOBALS)


@dataclass(frozen=True)
class Global:
    """A name that a pickle may use; it is this record and nothing else."""

    kind: str
    name: str


class Unfinished:
    """An object between its making and the state that fills it."""

    __slots__ = ("kind", "value")

    def __init__(self, kind: str, value: Any = None) -> None:
        self.kind, self.value = kind, value

    def filled(self) -> Any:
        """Its value; raises RefusedError where it has none yet."""
        if self.value is None:
            raise RefusedError(f"a {self.kind} used before it was filled", "arrays and plain data")
        return self.value


def find_global(module: str, name: str) -> Global:
    """What stands for a name. Raises RefusedError for one that is not known."""
    kind = GLOBALS.get((module, name))
    if kind is None:
        raise RefusedError(f"found the global {printable_start(f'{module}.{name}')}", ALLOWED)
    return Global(kind, f"{module}.{name}")


def call_global(target: Any, arguments: Any, budget: MemoryBudget) -> Any:
    """What REDUCE makes of a known global and its arguments."""
    if not isinstance(target, Global):
        raise RefusedError(f"a call of a {type(target).__name__}", ALLOWED)
    if target.kind not in _CALLS or not isinstance(arguments, tuple):
        raise RefusedError(f"a call of {target.name} that no array needs", "arrays and plain data")
    try:
        return _CALLS[target.kind](budget, *arguments)
    except TypeError as error:
        raise RefusedError(f"a call of {target.name} with other arguments") from error


def new_object(target: Any, arguments: Any) -> Unfinished:
    """What NEWOBJ makes: an object to be filled."""
    if not isinstance(target, Global) or target.kind not in ("chumpy", "select", "csc", "csr"):
        name = target.name if isinstance(target, Global) else type(target).__name__
        raise RefusedError(f"a new {name}", "chumpy and scipy.sparse objects")
    if not isinstance(arguments, tuple) or arguments:
        raise RefusedError(f"a new {target.name} with arguments", "none")
    return Unfinished(target.kind)


def fill_object(target: Any, state: Any, budget: MemoryBudget) -> None:
    """What BUILD does: give an object its state."""
    if not isinstance(target, Unfinished):
        raise RefusedError(f"a state for a {type(target).__name__}", "arrays and plain data")
    if target.kind == "dtype":
        target.value = dtype_with_order(target.value, state)
    elif target.value is not None:
        raise RefusedError(f"a {target.kind} filled twice", "once")
    elif target.kind == "ndarray":
        target.value = array_of_state(state, budget)
    else:
        if not isinstance(state, dict):
            raise RefusedError(f"a {target.kind} whose state is a {type(state).__name__}", "a dict")
        target.value = _FILLS[target.kind](state, budget)


def finished_value(item: Any, budget: MemoryBudget) -> Any:
    """An item as containers hold it: filled, decoded, and not a bare global."""
    kind = type(item)
    if kind is RawString:
        return item.value(budget)
    if kind is Unfinished:
        return item.filled()
    if kind is Global:
        raise RefusedError(f"{item.name} as a value", "arrays and plain data")
    if kind is tuple and len(item) <= TUPLE_OPEN:
        return tuple(finished_value(part, budget) for part in item) if _has_open(item) else item
    return item


TUPLE_OPEN = 8
"""Tuples up to here may hold Raw and Global: arguments and states. Longer ones are data."""
KEY_MAX = 4_000_000
"""Whole numbers as keys: frame numbers and rows. Python hashes larger ones just as they are, so
that a file could choose thousands that all fall into one place."""
KEY_LENGTH_MAX = 1000
"""Texts as keys: equal ones are compared to their end."""


def tuple_of(items: list[Any], budget: MemoryBudget) -> tuple[Any, ...]:
    """A tuple whose own parts may be RawString or Global, but none deeper.

    `finished_value` of it then takes little time.
    """
    if len(items) > TUPLE_OPEN:
        return tuple(finished_value(item, budget) for item in items)
    return tuple(
        item if type(item) in (RawString, Global) else finished_value(item, budget)
        for item in items
    )


def add_to_dict(target: dict[Any, Any], key: Any, value: Any, budget: MemoryBudget) -> None:
    """Add an entry to a dict, charged and finished."""
    key = key_of(key, budget)
    budget.spend(ENTRY_BYTES)
    target[key] = finished_value(value, budget)


def add_to_set(target: set[Any], item: Any, budget: MemoryBudget) -> None:
    """Add an entry to a set, charged and finished."""
    key = key_of(item, budget)
    budget.spend(ENTRY_BYTES)
    target.add(key)


def key_of(item: Any, budget: MemoryBudget) -> Any:
    """A dict's key or a set's entry: a plain value that hashes and compares in no time."""
    if isinstance(item, RawString) and len(item.view) > KEY_LENGTH_MAX:
        raise RefusedError(f"a key of {len(item.view)} bytes", f"up to {KEY_LENGTH_MAX}")
    item = finished_value(item, budget)
    if isinstance(item, np.generic):
        item = item.item()
    if isinstance(item, str | bytes):
        if len(item) > KEY_LENGTH_MAX:
            raise RefusedError(f"a key of {len(item)} bytes", f"up to {KEY_LENGTH_MAX}")
        return item
    if isinstance(item, int):
        if abs(item) > KEY_MAX:
            raise RefusedError("a large number as a key", f"{-KEY_MAX} to {KEY_MAX}")
        budget.count_key()
        return item
    if item is None:
        return item
    raise RefusedError(f"a {type(item).__name__} as a key", "text and whole numbers")


def _has_open(items: tuple[Any, ...]) -> bool:
    """Whether a tuple has parts that are not finished."""
    return any(type(item) in (RawString, Global, Unfinished) for item in items)


def _dtype(budget: MemoryBudget, name: Any, align: Any = False, copy: Any = True) -> Unfinished:
    """A type of numbers, whose byte order comes with its state."""
    if not isinstance(name, str) or name.lstrip("<>|=") not in DTYPES:
        kind = printable_start(name) if isinstance(name, str) else type(name).__name__
        raise RefusedError(f"an array of type {kind}", f"numbers: {' '.join(DTYPES)}")
    return Unfinished("dtype", np.dtype(name))


def _reconstruct(budget: MemoryBudget, target: Any, shape: Any, code: Any) -> Unfinished:
    """NumPy's empty array, which its state fills."""
    if not isinstance(target, Global) or target.kind != "ndarray":
        raise RefusedError("an array of another class", "numpy.ndarray")
    return Unfinished("ndarray")


def _reconstructor(budget: MemoryBudget, target: Any, base: Any, state: Any) -> Unfinished:
    """An object of an old-style class, which its state fills."""
    if not isinstance(base, Global) or base.kind != "object" or state is not None:
        raise RefusedError("an object built on another class", "object")
    return new_object(target, ())


def _scalar(budget: MemoryBudget, dtype: Any, raw: Any) -> Any:
    """One number."""
    return array_over_bytes(raw, dtype, (1,), "C", budget)[0]


def _frombuffer(budget: MemoryBudget, raw: Any, dtype: Any, shape: Any, order: Any) -> NDArray[Any]:
    """An array of protocol 5."""
    by_columns = isinstance(order, str) and order == "F"
    return array_over_bytes(raw, dtype, shape, "F" if by_columns else "C", budget)


def _encode(budget: MemoryBudget, text: Any, encoding: Any) -> bytes:
    """Bytes that protocols below 3 store as text."""
    text = finished_value(text, budget)
    latin = isinstance(encoding, str) and encoding in ("latin1", "latin-1")
    if not isinstance(text, str) or not latin:
        raise RefusedError("a call of _codecs.encode other than text to latin1")
    return bytes(bytes_of(text, budget))


def _empty_bytes(budget: MemoryBudget) -> bytes:
    """b"", as protocols below 3 store it."""
    return b""


def _set(budget: MemoryBudget, items: Any = ()) -> set[Any]:
    """A set of a list."""
    if not isinstance(items, list | tuple):
        raise RefusedError(f"a set of a {type(items).__name__}", "a list")
    budget.spend(CONTAINER_BYTES)
    result: set[Any] = set()
    for item in items:
        add_to_set(result, item, budget)
    return result


def _dict(budget: MemoryBudget, pairs: Any = ()) -> dict[Any, Any]:
    """A dict of a list of pairs."""
    if not isinstance(pairs, list | tuple):
        raise RefusedError(f"a dict of a {type(pairs).__name__}", "a list of pairs")
    budget.spend(CONTAINER_BYTES)
    result: dict[Any, Any] = {}
    for pair in pairs:
        if not isinstance(pair, list | tuple) or len(pair) != 2:
            raise RefusedError("a dict of something else", "a list of pairs")
        add_to_dict(result, pair[0], pair[1], budget)
    return result


_CALLS: dict[str, Callable[..., Any]] = {
    "reconstruct": _reconstruct,
    "reconstructor": _reconstructor,
    "scalar": _scalar,
    "frombuffer": _frombuffer,
    "dtype": _dtype,
    "encode": _encode,
    "set": _set,
    "dict": _dict,
    "bytes": _empty_bytes,
}
_FILLS: dict[str, Callable[[dict[Any, Any], MemoryBudget], Any]] = {
    "chumpy": array_of_chumpy,
    "select": array_of_select,
    "csc": sparse_of_state("csc"),
    "csr": sparse_of_state("csr"),
}
