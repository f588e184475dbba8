"""What a pool of workers is: a function over tasks, in any order and place."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from elocute.errors import ElocuteError

JOBS_MAX = 256
"""Workers beyond which a number is taken for a mistake."""


@dataclass(frozen=True)
class FailedTask:
    """Why a task has no result, though it was tried again."""

    reason: str


Pool = Callable[[Callable[[Any], Any], Iterable[Any]], Iterator[tuple[Any, Any]]]
"""Takes work and tasks; gives (task, result or FailedTask) in the order in which they are done.

`process_pool.local_pool` and `ray_cluster.ray_pool` make one."""


def one_after_another(
    work: Callable[[Any], Any], tasks: Iterable[Any]
) -> Iterator[tuple[Any, Any]]:
    """The Pool of this process alone: each task and its result, in the order given.

    The result is a FailedTask where `work` raised an error of Elocute.
    """
    for task in tasks:
        try:
            outcome = work(task)
        except ElocuteError as error:
            outcome = FailedTask(str(error))
        yield task, outcome
