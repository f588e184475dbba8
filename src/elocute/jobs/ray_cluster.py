"""Tasks over a Ray cluster: actors that keep torch loaded, one task at a time each.

The cluster always asks for a token. The driver runs on one of its nodes; corpus, recordings and
output have the same path on every node. An actor that dies is replaced and its task tried again; a
task on which too many actors die is given up with the reason.
"""

from __future__ import annotations

import contextlib
import importlib.util
import logging
import os
import re
import secrets
import socket
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from elocute.errors import ElocuteError, InputError, MachineError
from elocute.jobs.pool import FailedTask, Pool
from elocute.jobs.process_pool import THREADS, TRIES, TaskQueue, checked_jobs, run_task

LOCAL = "local"
ADDRESS = re.compile(r"([A-Za-z0-9_.-]{1,253}):(\d{1,5})")
CONNECT_S, JOIN_S = 5.0, 60.0
OBJECT_STORE_BYTES = 100_000_000  # tasks and results are small: sounds and shards go by files
PROBE = (
    "import sys, ray; ray.init(address=sys.argv[1], log_to_driver=False, logging_level='ERROR'); "
    "print('CPUS', int(ray.cluster_resources().get('CPU', 0)))"
)
TOKEN_FILE = Path(".ray") / "auth_token"


class ClusterError(MachineError):
    """A Ray cluster that cannot be used."""


def ray_pool(address: str, jobs: int) -> Pool:
    """A Pool of actors on a Ray cluster (HOST:PORT), or on a node that is started here (`local`).

    0 jobs take all processors of the cluster. Raises InputError for an impossible address or
    number, MachineError without Ray or a token, or where the cluster does not answer within
    `CONNECT_S` + `JOIN_S` seconds.
    """
    jobs = checked_jobs(jobs)
    if address != LOCAL:
        _host_and_port(address)
    _prepare(address == LOCAL)
    if address == LOCAL:
        count = jobs or os.cpu_count() or 1
        return lambda work, tasks: run_ray(work, tasks, None, count)
    free = _reach(address)
    count = min(jobs or free, free)
    return lambda work, tasks: run_ray(work, tasks, address, count)


def run_ray(
    work: Callable[[Any], Any],
    tasks: Iterable[Any],
    address: str | None,
    jobs: int,
    tries: int = TRIES,
) -> Iterator[tuple[Any, Any]]:
    """As `process_pool.run_local`, in actors of a Ray cluster; None as address starts a node."""
    import ray

    where: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.ERROR}
    if address is None:
        where |= {
            "num_cpus": jobs,
            "object_store_memory": OBJECT_STORE_BYTES,
            "include_dashboard": False,
        }
    ray.init(address or LOCAL, **where)
    actor = ray.remote(num_cpus=1, max_restarts=0)(_Worker)
    waiting, running = TaskQueue(tasks), {}

    def give(worker: Any) -> None:
        following = waiting.next()
        if following is None:
            if worker is not None:
                ray.kill(worker)
            return
        task, tried = following
        worker = worker or actor.remote()
        running[worker.run.remote(work, task)] = worker, task, tried + 1

    try:
        with contextlib.redirect_stdout(sys.stderr):  # for the cluster's notices
            for _ in range(jobs):
                give(None)
            while running:
                reference = ray.wait(list(running), num_returns=1)[0][0]
                worker, task, tried = running.pop(reference)
                alive, result = _result(reference, tried)
                if type(result) is FailedTask and tried < tries:
                    waiting.again(task, tried)
                else:
                    yield task, result
                if not alive:
                    ray.kill(worker)
                give(worker if alive else None)
    finally:
        ray.shutdown()


class _Worker:
    """An actor: what a task loads (torch, the corpus) stays loaded for the next."""

    def __init__(self) -> None:
        os.environ.update(dict.fromkeys(THREADS, "1"))  # read by torch when it is loaded

    def run(self, work: Callable[[Any], Any], task: Any) -> tuple[str, Any]:
        """Run one task."""
        return run_task(work, task)


def _result(reference: Any, tried: int) -> tuple[bool, Any]:
    """Whether the actor can continue, and what it made of its task."""
    import ray
    from ray.exceptions import OutOfMemoryError, RayActorError, RayError, WorkerCrashedError

    try:
        kind, value = ray.get(reference)
    except OutOfMemoryError:
        return False, FailedTask(f"its worker ran out of memory, {tried} times")
    except (RayActorError, WorkerCrashedError) as error:
        # Of every death Ray says that it may have been the lack of memory; of this one it knows.
        fate = "ran out of memory" if "running low on memory" in str(error) else "died"
        return False, FailedTask(f"its worker {fate}, {tried} times")
    except RayError as error:
        raise ClusterError(f"ray: {_line(str(error))}") from error
    return kind == "done", value


def _prepare(local: bool) -> None:
    """Set token authentication before Ray is loaded; make a token for a node of its own."""
    os.environ["RAY_AUTH_MODE"] = "token"
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    if importlib.util.find_spec("ray") is None:
        raise MachineError(
            "a Ray cluster needs ray; install it: pip install 'elocute[wild,cluster,train]'"
        )
    if _has_token():
        return
    if not local:
        raise ClusterError(
            "ray: found no token; allowed: RAY_AUTH_TOKEN, or a file named by RAY_AUTH_TOKEN_PATH "
            "or ~/.ray/auth_token, as on the cluster; make one: ray get-auth-token --generate"
        )
    os.environ["RAY_AUTH_TOKEN"] = secrets.token_hex(32)


def _has_token() -> bool:
    """Whether a token is set, by the environment or a file."""
    if os.environ.get("RAY_AUTH_TOKEN"):
        return True
    named = os.environ.get("RAY_AUTH_TOKEN_PATH")
    path = Path(named) if named else Path.home() / TOKEN_FILE
    return path.is_file() and path.stat().st_size > 0


def _host_and_port(address: str) -> tuple[str, int]:
    """Both parts of an address; raises InputError for anything else."""
    match = ADDRESS.fullmatch(address)
    if not match or not 0 < int(match[2]) < 65536:
        raise InputError.about(
            f"`ray` {address[:80]}",
            found="no address",
            allowed="HOST:PORT of a cluster (6379 by default), or local",
        )
    return match[1], int(match[2])


def _reach(address: str) -> int:
    """Processors of the cluster, asked in a process of its own, since Ray may end that one."""
    host, port = _host_and_port(address)
    try:
        socket.create_connection((host, port), CONNECT_S).close()
    except OSError as error:
        raise _unreachable(address, CONNECT_S, error.strerror or str(error)) from error
    try:
        probe = subprocess.run(
            [sys.executable, "-c", PROBE, address],
            capture_output=True,
            text=True,
            timeout=JOIN_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise _unreachable(address, JOIN_S, "it took the connection and said nothing") from error
    answer = re.search(r"CPUS (\d+)", probe.stdout)
    if answer and int(answer[1]):
        return int(answer[1])
    output = probe.stderr
    if answer:
        raise ClusterError(f"ray {address}: found no processor; allowed: one or more")
    if re.search(r"unauthenticated|authentication|InvalidAuth|token", output, re.IGNORECASE):
        raise ClusterError(f"ray {address}: the token was refused; allowed: the cluster's own")
    lines = [line for line in output.splitlines() if line.strip()]
    raise _unreachable(address, JOIN_S, _line(lines[-1]) if lines else "no answer")


def _unreachable(address: str, seconds: float, why: str) -> ElocuteError:
    """The error for a cluster that does not answer."""
    return ClusterError(
        f"ray {address}: cannot be reached within {seconds:g} s ({why}); allowed: a cluster that "
        "runs; start one: RAY_AUTH_MODE=token ray start --head"
    )


def _line(text: str) -> str:
    """The start of a text in one line."""
    return " ".join(text.split())[:200]
