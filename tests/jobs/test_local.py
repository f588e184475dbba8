"""Workers that die, run out of memory or refuse: what is done is done once, the rest goes on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from elocute.errors import InputError
from elocute.jobs.pool import FailedTask
from elocute.jobs.process_pool import checked_jobs, run_local
from tests.jobs import works

Run = Callable[..., dict[int, Any]]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """run("double", jobs) gives number to outcome of six tasks."""

    def call(name: str, jobs: int = 2) -> dict[int, Any]:
        tasks = ((str(tmp_path), number) for number in range(6))
        done = list(run_local(getattr(works, name), tasks, jobs))
        assert len(done) == 6
        return {task[1]: outcome for task, outcome in done}

    return call


def once(folder: Path) -> list[int]:
    """Numbers that were done, every one a single time."""
    notes = sorted(folder.glob("*.done"))
    assert all(note.read_text() == "once\n" for note in notes)
    return [int(note.stem) for note in notes]


ALL = {number: 2 * number for number in range(6)}
REST = [0, 1, 2, 4, 5]


def test_a_killed_worker_is_replaced(run: Run, tmp_path: Path):
    assert run("die_at_first") == ALL
    assert once(tmp_path) == sorted(ALL)


def test_a_task_that_kills_every_worker_is_given_up(run: Run, tmp_path: Path):
    found = run("die_always")
    failed = found.pop(3)
    assert (
        isinstance(failed, FailedTask) and "SIGKILL" in failed.reason and "3 times" in failed.reason
    )
    assert sorted(found) == REST == once(tmp_path)


def test_out_of_memory(run: Run, tmp_path: Path):
    found = run("eat", 1)
    assert isinstance(found[3], FailedTask) and "out of memory" in found[3].reason
    assert once(tmp_path) == REST


def test_bad_input_is_not_tried_again(run: Run, tmp_path: Path):
    found = run("refuse")
    assert isinstance(found[3], FailedTask) and found[3].reason.startswith("three: found wrong")
    assert once(tmp_path) == REST


@pytest.mark.parametrize("jobs", [-1, 257])
def test_numbers_that_are_no_number_of_workers(jobs: int):
    with pytest.raises(InputError, match="`jobs`"):
        checked_jobs(jobs)
