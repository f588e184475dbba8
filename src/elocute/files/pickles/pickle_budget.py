"""What a pickle may cost: bytes of copies, and what its result unfolds to when it is walked."""

from __future__ import annotations

from typing import Any

import numpy as np

FREE_BYTES = 64_000_000
SMALL_TIMES, LARGE_TIMES = 64, 2
"""Objects are larger than the few bytes that make them; what is large is data, not objects …"""
LARGE_FREE_BYTES = 512_000_000
"""… and this is where one passes into the other."""

CONTAINER_BYTES = 384  # an empty list, dict or set, its first entries, what a walk notes of it
ENTRY_BYTES = 128  # one entry of a dict or set, room to grow included
ARRAY_BYTES = 512  # an array beside its numbers
LEAF_BYTES = 32


NUMBER_KEYS_MAX = 1_000_000
"""Keys that are whole numbers: how often a file may have Python look for a place that is free."""


class RefusedError(Exception):
    """Why a pickle is not read: what was found, and what is allowed instead."""

    def __init__(self, found: str, allowed: str = "") -> None:
        super().__init__(found)
        self.found, self.allowed = found, allowed


class MemoryBudget:
    """Bytes that may be spent, so that a small file cannot unfold into a large one.

    They are charged before memory is taken. Opcodes that make a small object are not charged one by
    one: each is a byte of the file at least, and allows `SMALL_TIMES` as many.
    """

    def __init__(self, file_bytes: int) -> None:
        grown = min(SMALL_TIMES * file_bytes, LARGE_TIMES * file_bytes + LARGE_FREE_BYTES)
        self.left = grown + FREE_BYTES
        self._number_keys = NUMBER_KEYS_MAX

    def spend(self, count: int) -> None:
        """Charge bytes; raises RefusedError where fewer are left."""
        self.left -= count
        if self.left < 0:
            raise RefusedError(
                "data that unfolds to far more than the file", "arrays and plain data"
            )

    def count_key(self) -> None:
        """Count a whole number as a key; raises RefusedError for too many."""
        self._number_keys -= 1
        if self._number_keys < 0:
            raise RefusedError("too many numbers as keys", f"up to {NUMBER_KEYS_MAX}")


def check_unfolded(root: Any, budget: MemoryBudget) -> None:
    """Charge all that a walk over `root` meets, what is shared as often as it is met.

    Whatever reads the result may then walk it and copy its arrays without counting. Raises
    RefusedError where that is too much, and for containers that contain themselves.
    """
    most = budget.left + 1
    sizes: dict[int, int] = {}  # of containers, all of which `root` keeps alive
    opened: set[int] = set()
    waiting = [root] if _parts(root) is not None else []
    while waiting:
        item = waiting[-1]
        key = id(item)
        if key in sizes:
            waiting.pop()
        elif key in opened:
            total = CONTAINER_BYTES
            for part in _parts(item) or ():
                total += LEAF_BYTES + (sizes[id(part)] if id(part) in sizes else _leaf_bytes(part))
            sizes[key] = min(total, most)
            opened.discard(key)
            waiting.pop()
        else:
            opened.add(key)
            for part in _parts(item) or ():
                if type(part) in _CONTAINERS and id(part) not in sizes:
                    if id(part) in opened:
                        raise RefusedError("data that holds itself", "arrays and plain data")
                    waiting.append(part)
    budget.spend(sizes.get(id(root), _leaf_bytes(root)))


_CONTAINERS = (list, tuple, set, dict)


def _parts(item: Any) -> Any:
    """The items of a container, None for anything else."""
    if type(item) is dict:
        return item.values()
    return item if type(item) in _CONTAINERS else None


def _leaf_bytes(item: Any) -> int:
    """Bytes of a value that is not a container."""
    if isinstance(item, str | bytes):
        return len(item)
    if isinstance(item, np.ndarray):
        return ARRAY_BYTES + item.nbytes
    return int(getattr(item, "nbytes", 0))
