"""Jobs of the studio: two worker processes, one for what is quick and one for exports.

A job is cancelled by ending its process, and so is one that takes too long or too much memory; the
next job gets a new process. What a process had half written are drafts, which the next one removes.
"""

from __future__ import annotations

import contextlib
import queue
import secrets
import signal
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Any

from elocute.errors import ElocuteError, lacks_memory, printable
from elocute.jobs.process_pool import belong_to_driver, spawned
from elocute.studio.work import Task, run

QUEUED, RUNNING, DONE, FAILED, CANCELLED = "queued", "running", "done", "failed", "cancelled"
QUICK, SLOW = "quick", "slow"
LANES = {QUICK: 180.0, SLOW: 3600.0}
"""The workers, and how many seconds a job of each may take."""
WAITING_MAX = 32
"""Jobs that wait for one worker."""
KEPT = 200
"""Jobs that are remembered once they have ended."""
MEMORY_MAX_BYTES = 6_000_000_000
"""What a worker may take: a hostile file costs a job, not the machine."""
STEP = 0.01
"""Progress is told in steps of so much."""
LOOK_S = 0.1
END_S = 5.0


class BusyError(Exception):
    """Too many jobs wait."""


@dataclass(eq=False)
class Job:
    """One thing that a worker does.

    `project` is the name of the project that it is for, "" for none. `result` is what the task
    gave, once it is done; `error` one line, where it failed.
    """

    id: str
    task: Task
    project: str
    lane: str
    state: str = QUEUED
    progress: float = 0.0
    error: str = ""
    result: dict[str, Any] = field(default_factory=dict)
    ended: Future[Job] = field(default_factory=Future)
    _cancelled: threading.Event = field(default_factory=threading.Event)

    def record(self) -> dict[str, Any]:
        """What is told of it."""
        return {
            "id": self.id,
            "what": self.task.what,
            "project": self.project,
            "state": self.state,
            "progress": round(self.progress, 3),
            "error": self.error,
            "result": self.result,
        }

    @property
    def is_over(self) -> bool:
        return self.state in (DONE, FAILED, CANCELLED)


class Jobs:
    """All jobs, and the workers that do them.

    Parameters
    ----------
    tell : callable
        Takes the record of a job whenever it changes, in any thread.
    """

    def __init__(self, tell: Callable[[dict[str, Any]], None]) -> None:
        self._tell = tell
        self._jobs: OrderedDict[str, Job] = OrderedDict()
        self._lock = threading.Lock()
        self._lanes = {name: _Lane(seconds, self._changed) for name, seconds in LANES.items()}

    def submit(self, task: Task, *, lane: str = QUICK, project: str = "") -> Job:
        """Queue a task. A preview takes the place of earlier ones of its project that are not done.

        Raises BusyError.
        """
        with self._lock:
            job = Job(secrets.token_hex(8), task, project, lane)
            earlier = [
                each
                for each in self._jobs.values()
                if not each.is_over and (each.task.what, each.project) == (task.what, project)
            ]
            self._jobs[job.id] = job
            while len(self._jobs) > KEPT and (first := next(iter(self._jobs.values()))).is_over:
                del self._jobs[first.id]
        if project and task.what == "preview":
            for each in earlier:
                self.cancel(each.id)
        self._lanes[lane].put(job)
        return job

    def find(self, id: str) -> Job | None:
        """A job by its id."""
        return self._jobs.get(id)

    def all(self) -> list[dict[str, Any]]:
        """The records of all jobs that are remembered."""
        return [job.record() for job in list(self._jobs.values())]

    def cancel(self, id: str) -> None:
        """End a job that waits or runs; one that is over stays as it is."""
        job = self._jobs.get(id)
        if job is not None:
            job._cancelled.set()
            if job.state == QUEUED:
                self._changed(job, CANCELLED)

    def close(self) -> None:
        """End all workers."""
        for job in list(self._jobs.values()):
            job._cancelled.set()
        for lane in self._lanes.values():
            lane.close()

    def _changed(self, job: Job, state: str, progress: float | None = None) -> None:
        with self._lock:
            if job.is_over:
                return
            job.state = state
            if progress is not None:
                job.progress = progress
        self._tell(job.record())
        if job.is_over:
            job.ended.set_result(job)


class _Lane:
    """A queue, a thread that takes jobs from it, and the process that does them."""

    def __init__(self, seconds: float, changed: Callable[..., None]) -> None:
        self._seconds, self._changed = seconds, changed
        self._waiting: queue.Queue[Job | None] = queue.Queue(WAITING_MAX)
        self._process: Any = None
        self._pipe: Connection | None = None
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def put(self, job: Job) -> None:
        try:
            self._waiting.put_nowait(job)
        except queue.Full:
            job.error = f"{WAITING_MAX} jobs wait already; try again when some are done"
            self._changed(job, FAILED)
            raise BusyError(job.error) from None

    def close(self) -> None:
        self._stop()
        with contextlib.suppress(queue.Full):
            self._waiting.put_nowait(None)
        self._thread.join(END_S)
        self._stop()

    def _work(self) -> None:
        while (job := self._waiting.get()) is not None:
            if job.is_over or job._cancelled.is_set():
                self._changed(job, CANCELLED)
                continue
            self._changed(job, RUNNING, 0.0)
            try:
                state = self._do(job)
            except OSError as error:  # no process can be started
                job.error, state = f"no worker ({error.strerror})", FAILED
            self._changed(job, state, 1.0 if state == DONE else None)

    def _do(self, job: Job) -> str:
        """Give a job to the process, and follow it until it is over; its state then."""
        if self._process is None or not self._process.is_alive():
            self._stop()
            self._process, self._pipe = spawned(_serve, MEMORY_MAX_BYTES)
        pipe, ends = self._pipe, time.monotonic() + self._seconds
        assert pipe is not None
        try:
            pipe.send(job.task)
            while True:
                if job._cancelled.is_set():
                    self._stop()
                    return CANCELLED
                if time.monotonic() > ends:
                    self._stop()
                    job.error = f"took longer than {self._seconds:g} s, and was ended"
                    return FAILED
                if not pipe.poll(LOOK_S):
                    if not self._process.is_alive() and not pipe.poll():
                        raise EOFError
                    continue
                kind, value = pipe.recv()
                if kind == "progress":
                    self._changed(job, RUNNING, value)
                elif kind == "done":
                    job.result = value
                    return DONE
                else:
                    job.error = value
                    return FAILED
        except (EOFError, OSError):
            cancelled = job._cancelled.is_set()
            job.error = "" if cancelled else self._death()
            return CANCELLED if cancelled else FAILED

    def _death(self) -> str:
        """Why the process has ended, in one line."""
        process = self._process
        process.join(END_S)
        code = process.exitcode
        self._stop()
        if code is not None and code < 0:
            name = signal.Signals(-code).name
            return f"its worker was killed ({name}; out of memory?); try again"
        return f"its worker ended with code {code}; try again"

    def _stop(self) -> None:
        """End the process, whatever it does."""
        process, pipe, self._process, self._pipe = self._process, self._pipe, None, None
        if process is not None and process.is_alive():
            process.kill()
            process.join(END_S)
        if pipe is not None:
            pipe.close()


def _serve(pipe: Connection, memory_max_bytes: int) -> None:
    """In a worker: tasks in, progress and results out, until the driver is gone."""
    belong_to_driver()
    _limit_memory(memory_max_bytes)
    while True:
        try:
            task = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            answer = ("done", run(task, _Progress(pipe)))
        except ElocuteError as error:
            answer = ("failed", printable(error))
        except Exception as error:
            no_memory = "not enough memory for this; try a smaller file"
            told = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
            answer = ("failed", no_memory if lacks_memory(error) else printable(told))
        pipe.send(answer)


def _limit_memory(most: int) -> None:
    """Let this process take so many bytes of data, where the system can be told so."""
    try:
        import resource
    except ImportError:  # Windows
        return
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))


class _Progress:
    """Sends what share is done, not more often than it shows."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe, self._told = pipe, -1.0

    def __call__(self, share: float) -> None:
        if share - self._told >= STEP:
            self._told = share
            self._pipe.send(("progress", min(1.0, float(share))))
