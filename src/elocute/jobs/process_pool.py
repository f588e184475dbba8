"""Tasks over processes of this machine, one thread each.

A worker that dies (killed, out of memory) is replaced and its task tried again; a task on which
too many workers die is given up with the reason, and the others continue. Workers end with their
driver.
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
from elocute.jobs.pool import JOBS_MAX, FailedTask, Pool
from elocute.one_line_repr import brief

TRIES = 3
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
STOP_S = 5.0


@dataclass
class _Worker:
    """A process, the pipe to it, its task, and how often that was tried."""

    process: Any
    pipe: Connection
    task: Any = None
    tries: int = 0


def local_pool(jobs: int) -> Pool:
    """A Pool of so many processes of this machine, in any order; 0 is one for each processor.

    Raises InputError for a number outside 0 to `JOBS_MAX`.
    """
    count = checked_jobs(jobs) or os.cpu_count() or 1
    return lambda work, tasks: run_local(work, tasks, count)


def checked_jobs(jobs: int) -> int:
    """A number of workers; raises InputError for one outside 0 to `JOBS_MAX`."""
    if not 0 <= jobs <= JOBS_MAX:
        raise InputError.about("`jobs`", found=brief(jobs), allowed=f"0 to {JOBS_MAX}")
    return jobs


def run_local(
    work: Callable[[Any], Any], tasks: Iterable[Any], jobs: int, tries: int = TRIES
) -> Iterator[tuple[Any, Any]]:
    """Run tasks in processes of this machine; each task and its result, or a FailedTask.

    Pairs come in the order in which they are done; tasks are drawn when they are needed. `work`,
    tasks and results must be picklable. A task on which workers die is tried `tries` times.
    """
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
                if type(result) is FailedTask and worker.tries < tries:
                    waiting.again(task, worker.tries)
                else:
                    yield task, result
                following = waiting.next()
                if not alive or following is None:
                    _stop(worker)
                    workers.remove(worker)
                if following is not None:
                    if not alive:
                        worker = _started(work)
                        workers.append(worker)
                    _give(worker, *following)
    finally:
        for worker in workers:
            _stop(worker)


class TaskQueue:
    """Tasks that wait; those that are tried again come first."""

    def __init__(self, tasks: Iterable[Any]) -> None:
        self._tasks, self._again = iter(tasks), deque()

    def next(self) -> tuple[Any, int] | None:
        """A task and how often it was tried."""
        if self._again:
            return self._again.popleft()
        task = next(self._tasks, None)
        return None if task is None else (task, 0)

    def again(self, task: Any, tries: int) -> None:
        """Put a task back that was tried so often."""
        self._again.append((task, tries))


def _started(work: Callable[[Any], Any]) -> _Worker:
    """A new process that waits for tasks."""
    return _Worker(*spawned(_serve, work))


def spawned(target: Callable[[Connection, Any], None], given: Any) -> tuple[Any, Connection]:
    """A new process on one thread, and our end of the pipe whose other end `target` gets first."""
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=target, args=(theirs, given), daemon=True)
    with _one_thread(), _out_of_reach():
        process.start()
    theirs.close()
    return process, ours


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
    """Block Ctrl-C and a terminal's end for processes started here: the driver stops them.

    It holds while they load. Where signals cannot be blocked (Windows), `_serve` ignores Ctrl-C
    once it has begun.
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
    """Send a task to a worker."""
    worker.task, worker.tries = task, tries + 1
    with contextlib.suppress(OSError):  # a worker that died already is found by its sentinel
        worker.pipe.send(task)


def _result(worker: _Worker) -> tuple[bool, Any]:
    """Whether the worker can continue, and what it made of its task."""
    try:
        if worker.pipe.poll():
            kind, value = worker.pipe.recv()
            return kind == "done", value
    except (EOFError, ConnectionError):
        pass
    worker.process.join(STOP_S)
    code = worker.process.exitcode
    if code is None:
        reason = "its worker hung up"
    elif code < 0:
        reason = f"its worker was killed ({signal.Signals(-code).name}; out of memory?)"
    else:
        reason = f"its worker ended with code {code}"
    return False, FailedTask(f"{reason}, {worker.tries} times")


def _stop(worker: _Worker) -> None:
    """End a worker."""
    worker.pipe.close()
    if worker.process.is_alive():
        worker.process.terminate()
    worker.process.join(STOP_S)


def _serve(pipe: Connection, work: Callable[[Any], Any]) -> None:
    """In a worker: a task in, its result out, until the driver closes the pipe or dies."""
    belong_to_driver()
    while True:
        try:
            task = pipe.recv()
        except (EOFError, OSError):
            return
        pipe.send(run_task(work, task))


def belong_to_driver() -> None:
    """In a worker: the driver stops it, not Ctrl-C, and it ends with its driver."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def run_task(work: Callable[[Any], Any], task: Any) -> tuple[str, Any]:
    """Run one task in a worker: "done", or "failed" where it cannot continue, and the result.

    The result is what `work` gave, a RefusedTask where it raised, or FailedTask where memory ran
    out.
    """
    try:
        return "done", work(task)
    except MemoryError:
        return "failed", FailedTask("out of memory")
    except ElocuteError as error:
        return "done", RefusedTask(str(error))
    except Exception as error:
        return "done", RefusedTask(f"{type(error).__name__}: {error}")


class RefusedTask(FailedTask):
    """A task that is not tried again: bad input does not become better by that."""


def _end_with_parent() -> None:
    """End this process when its driver has ended."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
