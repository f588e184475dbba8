"""A closed unpickler: it reads the pickles of FLAME and VOCASET, and can do nothing else.

Python's own unpickler runs what a file says. This one is a stack machine over a table of opcodes
that knows plain data, NumPy arrays of numbers, chumpy objects and sparse matrices; any other global
or opcode is refused by name. Nothing is imported or called because a file says so.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from elocute.errors import InputError
from elocute.files.pickles.pickle_arrays import SparseMatrix
from elocute.files.pickles.pickle_budget import (
    CONTAINER_BYTES,
    MemoryBudget,
    RefusedError,
    check_unfolded,
)
from elocute.files.pickles.pickle_cursor import WHOLE, Cursor
from elocute.files.pickles.pickle_objects import (
    add_to_dict,
    add_to_set,
    call_global,
    fill_object,
    find_global,
    finished_value,
    new_object,
    tuple_of,
)
from elocute.files.reading import FileKind, read_bytes

FILE_MAX_BYTES = 2_000_000_000
STEPS_MAX = 5_000_000
"""Opcodes per file: VOCASET's largest index has some 500,000; each can make one small object."""

__all__ = ["SparseMatrix", "read_pickle"]


def read_pickle(path: str | Path, *, max_bytes: int = FILE_MAX_BYTES) -> Any:
    """Read a pickle (protocols 0 to 5) of Python 2 or 3, of up to `max_bytes`, as inert data.

    Text of Python 2 is read as Latin-1. Arrays are read-only views of the file's bytes, so that
    nothing large is copied; a chumpy object becomes its array, a scipy matrix a `SparseMatrix`, an
    OrderedDict a dict. Reading takes memory in proportion to the file, and so does a walk over the
    result: what is shared counts as often as it is met.

    Raises InputError for a file that is missing, larger, cut short or not a pickle, unfolds to far
    more than its size, or holds anything else.
    """
    path = Path(path)
    data = read_bytes(path, FileKind("a pickle", max_bytes))
    try:
        return _Machine(data).run()
    except RefusedError as refusal:
        broken = refusal.allowed == WHOLE
        found = f"no pickle, or a broken one ({refusal.found})" if broken else refusal.found
        raise InputError.about(path, found=found, allowed=refusal.allowed) from refusal
    except (MemoryError, RecursionError) as error:
        raise InputError.about(path, found="more than fits into memory") from error


class _Machine:
    """A stack, marks on it, and the memo."""

    def __init__(self, data: bytes) -> None:
        self.budget = MemoryBudget(len(data))
        self.cursor = Cursor(data, self.budget)
        self.stack: list[Any] = []
        self.marks: list[int] = []
        self.memo: list[Any] = []  # by index; picklers count from 0 or 1
        self.memo_max = len(data)
        self.remembered = 0

    def run(self) -> Any:
        """The value of the pickle, finished and within its budget."""
        cursor = self.cursor
        for _ in range(STEPS_MAX):
            name = cursor.opcode()
            if name == "STOP":
                result = finished_value(self.pop(), self.budget)
                check_unfolded(result, MemoryBudget(self.memo_max))
                return result
            action = _ACTIONS.get(name)
            if action is None:
                raise RefusedError(f"found the opcode {name}", "arrays and plain data")
            action(self, cursor.argument())
        raise RefusedError(f"more than {STEPS_MAX} opcodes", "arrays and plain data")

    def push(self, item: Any) -> None:
        """Put an item on the stack."""
        self.stack.append(item)

    def pop(self) -> Any:
        """Take the topmost item above the last mark."""
        if len(self.stack) <= (self.marks[-1] if self.marks else 0):
            raise RefusedError("an opcode that finds nothing on the stack", WHOLE)
        return self.stack.pop()

    def top(self, kind: type) -> Any:
        """The topmost item, left in place, which must be a container of one kind."""
        self.push(item := self.pop())
        if type(item) is not kind:
            raise RefusedError(f"entries for a {type(item).__name__}", f"a {kind.__name__}")
        return item

    def pop_to_mark(self) -> list[Any]:
        """Take the last mark and all items above it."""
        if not self.marks:
            raise RefusedError("an opcode that finds no mark on the stack", WHOLE)
        place = self.marks.pop()
        items = self.stack[place:]
        del self.stack[place:]
        return items


_Action = Callable[[_Machine, Any], None]


def _push(machine: _Machine, argument: Any) -> None:
    """Push the opcode's argument."""
    machine.push(argument)


def _nothing(machine: _Machine, argument: Any) -> None:
    """PROTO and FRAME: nothing to do."""


def _constant(make: Callable[[], Any]) -> _Action:
    """An action that pushes what `make` gives."""
    return lambda machine, _: machine.push(make())


def _mark(machine: _Machine, _: Any) -> None:
    """MARK: note where the stack stands."""
    machine.marks.append(len(machine.stack))


def _pop(machine: _Machine, _: Any) -> None:
    """POP: drop the topmost item, or the mark where nothing lies on it."""
    if machine.marks and machine.marks[-1] == len(machine.stack):
        machine.marks.pop()  # POP takes a mark away too
    else:
        machine.pop()


def _pop_mark(machine: _Machine, _: Any) -> None:
    """POP_MARK: drop all above the last mark."""
    machine.pop_to_mark()


def _duplicate(machine: _Machine, _: Any) -> None:
    """DUP: push the topmost item again."""
    item = machine.pop()
    machine.stack += [item, item]


def _put(machine: _Machine, index: int) -> None:
    """PUT and its kin: note the topmost item under an index."""
    item, memo = machine.pop(), machine.memo
    machine.push(item)
    if not 0 <= index < machine.memo_max:
        raise RefusedError(f"memo entry {index} of a file of {machine.memo_max} bytes", WHOLE)
    if index >= len(memo):
        memo.extend([_NOTHING] * (index + 1 - len(memo)))
    machine.remembered += memo[index] is _NOTHING
    memo[index] = item


_NOTHING = object()


def _memoize(machine: _Machine, _: Any) -> None:
    """MEMOIZE: note the topmost item under the next index."""
    _put(machine, machine.remembered)


def _get(machine: _Machine, index: int) -> None:
    """GET and its kin: push what was noted under an index."""
    memo = machine.memo
    if not 0 <= index < len(memo) or memo[index] is _NOTHING:
        raise RefusedError(f"memo entry {index}, which was never made", WHOLE)
    machine.push(memo[index])


def _tuple(count: int | None) -> _Action:
    """An action that makes a tuple of `count` items, or of all above the mark."""

    def act(machine: _Machine, _: Any) -> None:
        if count is None:
            items = machine.pop_to_mark()
        else:
            items = [machine.pop() for _ in range(count)][::-1]
        machine.budget.spend(CONTAINER_BYTES)
        machine.push(tuple_of(items, machine.budget))

    return act


def _empty(make: Callable[[], Any]) -> _Action:
    """An action that pushes an empty container."""

    def act(machine: _Machine, _: Any) -> None:
        machine.budget.spend(CONTAINER_BYTES)
        machine.push(make())

    return act


def _list(machine: _Machine, _: Any) -> None:
    """LIST: make a list of all above the mark."""
    machine.budget.spend(CONTAINER_BYTES)
    machine.push([finished_value(item, machine.budget) for item in machine.pop_to_mark()])


def _append(machine: _Machine, _: Any) -> None:
    """APPEND: add an item to a list."""
    item = finished_value(machine.pop(), machine.budget)
    machine.top(list).append(item)


def _appends(machine: _Machine, _: Any) -> None:
    """APPENDS: add all above the mark to a list."""
    items = machine.pop_to_mark()
    machine.top(list).extend(finished_value(item, machine.budget) for item in items)


def _dict(machine: _Machine, _: Any) -> None:
    """DICT: make a dict of keys and values above the mark."""
    machine.budget.spend(CONTAINER_BYTES)
    _add_pairs(machine, result := {}, machine.pop_to_mark())
    machine.push(result)


def _set_item(machine: _Machine, _: Any) -> None:
    """SETITEM: add a key and a value to a dict."""
    value, key = machine.pop(), machine.pop()
    add_to_dict(machine.top(dict), key, value, machine.budget)


def _set_items(machine: _Machine, _: Any) -> None:
    """SETITEMS: add keys and values above the mark to a dict."""
    items = machine.pop_to_mark()
    _add_pairs(machine, machine.top(dict), items)


def _add_pairs(machine: _Machine, target: dict[Any, Any], items: list[Any]) -> None:
    """Add keys and values, one after another, to a dict."""
    if len(items) % 2:
        raise RefusedError("a key without a value", WHOLE)
    for key, value in zip(items[::2], items[1::2], strict=True):
        add_to_dict(target, key, value, machine.budget)


def _add_items(machine: _Machine, _: Any) -> None:
    """ADDITEMS: add all above the mark to a set."""
    items = machine.pop_to_mark()
    target = machine.top(set)
    for item in items:
        add_to_set(target, item, machine.budget)


def _global(machine: _Machine, names: tuple[str, str]) -> None:
    """GLOBAL: push what stands for a name."""
    machine.push(find_global(*names))


def _stack_global(machine: _Machine, _: Any) -> None:
    """STACK_GLOBAL: the same, with module and name from the stack."""
    name, module = (finished_value(machine.pop(), machine.budget) for _ in range(2))
    if not isinstance(name, str) or not isinstance(module, str):
        raise RefusedError("a global whose name is no text", "arrays and plain data")
    machine.push(find_global(module, name))


def _instance(machine: _Machine, names: tuple[str, str]) -> None:
    """INST makes objects of old-style classes: none is known, but the name is worth reporting."""
    raise RefusedError(f"an instance of {find_global(*names).name}", "arrays and plain data")


def _reduce(machine: _Machine, _: Any) -> None:
    """REDUCE: push what a known global makes of its arguments."""
    arguments, target = machine.pop(), machine.pop()
    machine.push(call_global(target, arguments, machine.budget))


def _new_object(machine: _Machine, _: Any) -> None:
    """NEWOBJ: push an object to be filled."""
    arguments, target = machine.pop(), machine.pop()
    machine.push(new_object(target, arguments))


def _build(machine: _Machine, _: Any) -> None:
    """BUILD: fill an object with its state."""
    state, target = machine.pop(), machine.pop()
    fill_object(target, state, machine.budget)
    machine.push(target)


_ACTIONS: dict[str, _Action] = {
    **dict.fromkeys(("PROTO", "FRAME"), _nothing),
    **dict.fromkeys(
        (
            "INT",
            "BININT",
            "BININT1",
            "BININT2",
            "LONG",
            "LONG1",
            "LONG4",
            "FLOAT",
            "BINFLOAT",
            "STRING",
            "BINSTRING",
            "SHORT_BINSTRING",
            "BINBYTES",
            "SHORT_BINBYTES",
            "BINBYTES8",
            "BYTEARRAY8",
            "UNICODE",
            "BINUNICODE",
            "SHORT_BINUNICODE",
            "BINUNICODE8",
        ),
        _push,
    ),
    "NONE": _constant(lambda: None),
    "NEWTRUE": _constant(lambda: True),
    "NEWFALSE": _constant(lambda: False),
    "EMPTY_LIST": _empty(list),
    "EMPTY_DICT": _empty(dict),
    "EMPTY_SET": _empty(set),
    "EMPTY_TUPLE": _constant(tuple),
    "TUPLE": _tuple(None),
    "TUPLE1": _tuple(1),
    "TUPLE2": _tuple(2),
    "TUPLE3": _tuple(3),
    "LIST": _list,
    "APPEND": _append,
    "APPENDS": _appends,
    "DICT": _dict,
    "SETITEM": _set_item,
    "SETITEMS": _set_items,
    "ADDITEMS": _add_items,
    "MARK": _mark,
    "POP": _pop,
    "POP_MARK": _pop_mark,
    "DUP": _duplicate,
    **dict.fromkeys(("PUT", "BINPUT", "LONG_BINPUT"), _put),
    "MEMOIZE": _memoize,
    **dict.fromkeys(("GET", "BINGET", "LONG_BINGET"), _get),
    "GLOBAL": _global,
    "STACK_GLOBAL": _stack_global,
    "INST": _instance,
    "REDUCE": _reduce,
    "NEWOBJ": _new_object,
    "BUILD": _build,
}
