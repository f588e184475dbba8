"""Work for workers; imported by name in processes of their own."""

from __future__ import annotations

import os
import resource
import signal
from pathlib import Path

import numpy as np

from elocute.errors import CorpusError

Task = tuple[str, int]
"""A folder for notes, and a number."""


def double(task: Task) -> int:
    folder, number = task
    with (Path(folder) / f"{number}.done").open("a") as file:
        file.write("once\n")
    return 2 * number


def die_at_first(task: Task) -> int:
    """Task 3 takes its worker down the first time."""
    mark = Path(task[0]) / "died"
    if task[1] == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return double(task)


def die_always(task: Task) -> int:
    if task[1] == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return double(task)


def eat(task: Task) -> int:
    """Task 3 wants more memory than a process may have."""
    if task[1] == 3:
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + 2**28, resource.RLIM_INFINITY))
        try:
            np.ones(2**31, np.float64)
        finally:
            resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    return double(task)


def refuse(task: Task) -> int:
    if task[1] == 3:
        raise CorpusError("three: found wrong; allowed: right")
    return double(task)
