"""A real Ray node with a token: the same bytes as without it, workers and drivers killed."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import secrets
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.commands import python, run_apart, run_python

pytestmark = [
    pytest.mark.slow,
    pytest.mark.cluster,
    pytest.mark.skipif(not importlib.util.find_spec("ray"), reason="needs the extra `cluster`"),
    pytest.mark.skipif(not Path("/proc/self").exists(), reason="finds workers in Linux's /proc"),
]
ROOT = Path(__file__).resolve().parents[2]
STARTS = 4
DRIVER = """
import json
from tests.jobs import works
from elocute.jobs.ray_cluster import ray_pool
tasks = [({folder!r}, number) for number in range(6)]
pool = ray_pool({address!r}, 2)
print(json.dumps([(t[1], r if isinstance(r, int) else r.reason)
                  for t, r in pool(getattr(works, {name!r}), tasks)]))
"""


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


@pytest.fixture(scope="module")
def node(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, dict[str, str]]]:
    """Address of a node with two processors, and the environment with its token."""
    room = tmp_path_factory.mktemp("r")
    environment = os.environ | {
        "RAY_AUTH_MODE": "token",
        "RAY_AUTH_TOKEN": secrets.token_hex(32),
        "HOME": str(room),
        "RAY_USAGE_STATS_ENABLED": "0",
        "OMP_NUM_THREADS": "1",
        "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
    }
    told = ""
    # Ray gives its own agent 15 s to load, which a busy machine needs for that alone.
    for _ in range(STARTS):
        process, address, told = started(environment)
        if address:
            break
    else:
        pytest.fail(f"the node did not start: {told}")
    yield address, environment
    end(process)


def started(environment: dict[str, str]) -> tuple[subprocess.Popen[str], str, str]:
    """A process, the address of its node or "", and the last that it said."""
    port = free_port()
    call = [
        Path(sys.executable).with_name("ray"),
        "start",
        "--head",
        "--block",
        "--port",
        port,
        "--num-cpus",
        2,
        "--object-store-memory",
        80_000_000,
        "--include-dashboard=false",
        "--disable-usage-stats",
    ]
    process = subprocess.Popen(
        [str(part) for part in call],
        env=environment,
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    told = []
    for line in process.stdout:
        told.append(line)
        if "Ray runtime started" in line:
            threading.Thread(target=process.stdout.read, daemon=True).start()
            return process, f"127.0.0.1:{port}", ""
    end(process)
    return process, "", "".join(told[-5:])


def end(process: subprocess.Popen[str]) -> None:
    """Nothing of this node is to be kept."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert process.stdout is not None
    process.stdout.close()


def drive(node: tuple[str, dict[str, str]], name: str, folder: Path, **more: str):
    address, environment = node
    code = DRIVER.format(folder=str(folder), address=address, name=name)
    return run_python("-c", code, env=environment | more)


def outcome(result: subprocess.CompletedProcess[str]) -> dict:
    """Number to what came of it: the driver's last line, after what Ray says."""
    assert result.returncode == 0, result.stderr
    return dict(json.loads(result.stdout.splitlines()[-1]))


def once(folder: Path) -> list[int]:
    notes = sorted(folder.glob("*.done"))
    assert all(note.read_text() == "once\n" for note in notes)
    return [int(note.stem) for note in notes]


def test_an_actor_that_dies_is_replaced(node, tmp_path: Path):
    result = drive(node, "die_at_first", tmp_path)
    assert result.returncode == 0, result.stderr
    assert outcome(result) == {n: 2 * n for n in range(6)}
    assert once(tmp_path) == list(range(6))


def test_a_task_that_kills_every_actor_is_given_up(node, tmp_path: Path):
    result = drive(node, "die_always", tmp_path)
    found = outcome(result)
    assert "died, 3 times" in found.pop(3) and once(tmp_path) == sorted(found) == [0, 1, 2, 4, 5]


def test_out_of_memory(node, tmp_path: Path):
    found = outcome(drive(node, "eat", tmp_path))
    assert "out of memory" in found.pop(3) and once(tmp_path) == sorted(found)


def test_another_token_is_refused(node, tmp_path: Path):
    result = drive(node, "double", tmp_path, RAY_AUTH_TOKEN=secrets.token_hex(32))
    assert "ClusterError" in result.stderr and "token was refused" in result.stderr
    assert once(tmp_path) == []


def test_no_cluster_there(tmp_path: Path):
    from elocute.errors import MachineError
    from elocute.jobs.ray_cluster import CONNECT_S, ray_pool

    kept = {name: os.environ.get(name) for name in ("RAY_AUTH_MODE", "RAY_AUTH_TOKEN")}
    os.environ["RAY_AUTH_TOKEN"] = secrets.token_hex(32)
    started = time.monotonic()
    try:
        with pytest.raises(MachineError, match="cannot be reached within 5 s"):
            ray_pool(f"127.0.0.1:{free_port()}", 1)
    finally:
        for name, value in kept.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value
    assert time.monotonic() - started < CONNECT_S + 60  # Ray's own patience is minutes


def test_propagate_on_the_cluster_and_a_killed_driver(node, wild: Path, tmp_path: Path):
    """A driver killed half-way, then again: every clip once, the same bytes as without Ray."""
    address, environment = node
    common = [
        "propagate",
        wild / "captured",
        wild / "recordings",
        "--words",
        wild / "captured_words",
        "--root",
        wild,
        "--method",
        "dtw",
        "--json",
        "-o",
    ]

    output, plain = tmp_path / "ray", tmp_path / "plain"
    start = python("-m", "elocute", *common, output, "--ray", address)
    with subprocess.Popen(start, env=environment) as driver:
        until = time.monotonic() + 240
        while not list((output / "records").glob("*.json")) and driver.poll() is None:
            assert time.monotonic() < until
            time.sleep(0.02)
        driver.kill()
    assert not (output / "manifest.json").exists()
    again = run_apart(*common, output, "--ray", address, "--resume", env=environment)
    assert again.returncode == 0, again.stderr
    assert json.loads(again.stdout)["kept"] >= 1
    # Blendshapes learned from vertices end in other bits with another number of threads.
    run_apart(*common, plain, check=True, env=os.environ | {"OMP_NUM_THREADS": "1"})
    for path in [*plain.glob("*.parquet"), plain / "manifest.json"]:
        assert (output / path.name).read_bytes() == path.read_bytes(), path.name
