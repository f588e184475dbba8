"""Tasks over processes of this machine, one thread each.

A worker that dies (killed, out of memory) is replaced and its task tried again; a task that takes
down too many is given up with the reason, and the others go on. Workers end with their driver.
"""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from multiprocessing import connection, get_context, parent_process
from multiprocessing.connection import Connection
from typing import Any

from elocute.errors import ElocuteError, InputError
from elocute.jobs.pool import JOBS_MAX, Failed, Pool
from elocute.one_line_repr import brief

TRIES = 3
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
STOP_S = 5.0


@dataclass
class _Worker:
    process: Any
    pipe: Connection
    task: Any = None
    tries: int = 0


def local_pool(jobs: int) -> Pool:
    """A Pool of that many processes; 0 takes one for each processor. Raises InputError."""
    count = checked_jobs(jobs) or os.cpu_count() or 1
    return lambda work, tasks: run_local(work, tasks, count)


def checked_jobs(jobs: int) -> int:
    """Raises InputError for a number of workers that no machine has."""
    if not 0 <= jobs <= JOBS_MAX:
        raise InputError.about("`jobs`", found=brief(jobs), allowed=f"0 to {JOBS_MAX}")
    return jobs


def run_local(
    work: Callable[[Any], Any], tasks: Iterable[Any], jobs: int, tries: int = TRIES
) -> Iterator[tuple[Any, Any]]:
    """(task, result or Failed) in the order in which they are done; tasks are drawn when needed."""
    waiting = TaskQueue(tasks)
    workers = []
    try:
        while len(workers) < jobs and (first := waiting.next()) is not None:
            workers.append(_started(work))
            _give(workers[-1], *first)
        while workers:
            ready = connection.wait(
                [w.pipe for w in workers] + [w.process.sentinel for w in workers]
            )
            for worker in [w for w in workers if w.pipe in ready or w.process.sentinel in ready]:
                task = worker.task
                alive, result = _result(worker)
                if type(result) is Failed and worker.tries < tries:
                    waiting.again(task, worker.tries)
                else:
                    yield task, result
                if not alive:
                    _stop(worker)
                    workers.remove(worker)
                    worker = None
                following = waiting.next()
                if following is None:
                    if worker is not None:
                        _stop(worker)
                        workers.remove(worker)
                    continue
                if worker is None:
                    worker = _started(work)
                    workers.append(worker)
                _give(worker, *following)
    finally:
        for worker in workers:
            _stop(worker)


class TaskQueue:
    """Tasks that wait, those that are tried again first."""

    def __init__(self, tasks: Iterable[Any]) -> None:
        self._tasks, self._again = iter(tasks), deque()

    def next(self) -> tuple[Any, int] | None:
        """A task and how often it was tried."""
        if self._again:
            return self._again.popleft()
        task = next(self._tasks, None)
        return None if task is None else (task, 0)

    def again(self, task: Any, tries: int) -> None:
        self._again.append((task, tries))


def _started(work: Callable[[Any], Any]) -> _Worker:
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_serve, args=(theirs, work), daemon=True)
    with _one_thread(), _out_of_reach():
        process.start()
    theirs.close()
    return _Worker(process, ours)


@contextlib.contextmanager
def _one_thread() -> Iterator[None]:
    """Libraries read these when they load: the number of processes is the parallelism."""
    kept = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in kept.items():
            if value is None:
                os.environ.pop(name)
            else:
                os.environ[name] = value


@contextlib.contextmanager
def _out_of_reach() -> Iterator[None]:
    """Processes started here never hear of Ctrl-C, not even while they load: we stop them.

    Nor of the end of a terminal.

    Where signals cannot be held back (Windows), `_serve` ignores it once it has begun.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    kept = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, kept)


def _give(worker: _Worker, task: Any, tries: int) -> None:
    worker.task, worker.tries = task, tries + 1
    with contextlib.suppress(OSError):  # a worker that died already is found by its sentinel
        worker.pipe.send(task)


def _result(worker: _Worker) -> tuple[bool, Any]:
    """Whether the worker can go on, and what it made of its task."""
    try:
        if worker.pipe.poll():
            kind, value = worker.pipe.recv()
            return kind == "done", value
    except (EOFError, ConnectionError):
        pass
    worker.process.join(STOP_S)
    code = worker.process.exitcode
    if code is None:
        told = "its worker hung up"
    elif code < 0:
        told = f"its worker was killed ({signal.Signals(-code).name}; out of memory?)"
    else:
        told = f"its worker ended with code {code}"
    return False, Failed(f"{told}, {worker.tries} times")


def _stop(worker: _Worker) -> None:
    worker.pipe.close()
    if worker.process.is_alive():
        worker.process.terminate()
    worker.process.join(STOP_S)


def _serve(pipe: Connection, work: Callable[[Any], Any]) -> None:
    """In a worker: a task in, its result out, until the driver closes the pipe or dies."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the driver stops its workers itself
    threading.Thread(target=_end_with_parent, daemon=True).start()
    while True:
        try:
            task = pipe.recv()
        except (EOFError, OSError):
            return
        pipe.send(attempt(work, task))


def attempt(work: Callable[[Any], Any], task: Any) -> tuple[str, Any]:
    """("done", result or GivenUp), or ("failed", Failed) where memory ran out."""
    try:
        return "done", work(task)
    except MemoryError:
        return "failed", Failed("out of memory")
    except ElocuteError as error:
        return "done", GivenUp(str(error))
    except Exception as error:
        return "done", GivenUp(f"{type(error).__name__}: {error}")


class GivenUp(Failed):
    """For good: bad input does not become better by trying again."""


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
