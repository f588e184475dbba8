"""Workers of the studio: progress, cancelling, deadlines, and processes that die."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from typing import Any

import pytest

from elocute.studio import jobs as module
from elocute.studio.jobs import CANCELLED, DONE, FAILED, QUICK, BusyError, Jobs
from elocute.studio.work import Task
from tests.support.browser import eventually

WAIT_S = 120


class Told:
    """Records of jobs as they were told, and a way to wait for one."""

    def __init__(self) -> None:
        self.records: list[dict[str, Any]] = []

    def __call__(self, record: dict[str, Any]) -> None:
        self.records.append(record)

    def states(self, id: str) -> list[str]:
        states = [each["state"] for each in self.records if each["id"] == id]
        return list(dict.fromkeys(states))


@pytest.fixture
def told() -> Told:
    return Told()


@pytest.fixture
def jobs(told: Told, monkeypatch: pytest.MonkeyPatch) -> Iterator[Jobs]:
    made = Jobs(told)
    yield made
    made.close()


def worker(jobs: Jobs) -> int:
    """The process of the quick worker, once it runs."""
    lane = jobs._lanes[QUICK]
    assert eventually(lambda: lane._process is not None and lane._process.is_alive())
    return lane._process.pid


def test_a_job_is_queued_and_runs_and_is_done(jobs: Jobs, told: Told, tmp_path):
    from tests.study.studies import flashing

    flashing(tmp_path / "a.mp4", (9, 9, 9))
    task = Task("probe", {"path": str(tmp_path / "a.mp4"), "name": "a.mp4"})
    job = jobs.submit(task).ended.result(WAIT_S)
    assert (job.state, job.progress, job.result["duration_s"]) == (
        DONE,
        1.0,
        pytest.approx(1.2, abs=0.05),
    )
    assert told.states(job.id) == ["running", "done"]
    # What is wrong with a file is told in one line, by the name it came with.
    (tmp_path / "b").write_bytes(b"RIFF" + bytes(500))
    failed = jobs.submit(Task("probe", {"path": str(tmp_path / "b"), "name": "b.wav"}))
    error = failed.ended.result(WAIT_S).error
    assert failed.state == FAILED and error.startswith("b.wav: ") and str(tmp_path) not in error
    assert jobs.find(failed.id) is failed and jobs.find("0" * 16) is None


def test_cancelling_ends_the_process_and_the_next_job_gets_another(jobs: Jobs, told: Told):
    first = jobs.submit(Task("warm", {"cache": "/nowhere"}), project="a")
    second = jobs.submit(Task("about", {"recogniser": "base"}))
    before = worker(jobs)
    jobs.cancel(first.id)
    assert first.ended.result(WAIT_S).state == CANCELLED
    assert second.ended.result(WAIT_S).state == DONE
    assert worker(jobs) != before
    with pytest.raises(ProcessLookupError):
        os.kill(before, 0)
    jobs.cancel(second.id)  # it is over, and stays so
    assert second.state == DONE


def test_a_job_that_waits_is_cancelled_without_being_begun(jobs: Jobs, told: Told):
    first = jobs.submit(Task("about", {"recogniser": "base"}))
    second = jobs.submit(Task("about", {"recogniser": "base"}))
    jobs.cancel(second.id)
    assert second.ended.result(WAIT_S).state == CANCELLED
    assert first.ended.result(WAIT_S).state == DONE
    assert told.states(second.id) == [CANCELLED]


def test_a_worker_that_is_killed_tells_so_and_the_next_job_is_done(jobs: Jobs):
    job = jobs.submit(Task("warm", {"cache": "/nowhere"}))
    os.kill(worker(jobs), signal.SIGKILL)
    assert job.ended.result(WAIT_S).state == FAILED
    assert "its worker was killed (SIGKILL; out of memory?)" in job.error
    assert jobs.submit(Task("about", {"recogniser": "base"})).ended.result(WAIT_S).state == DONE


def test_a_job_that_takes_too_long_is_ended(told: Told, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(module.LANES, QUICK, 0.01)
    jobs = Jobs(told)
    job = jobs.submit(Task("about", {"recogniser": "base"}))
    assert job.ended.result(WAIT_S).error == "took longer than 0.01 s, and was ended"
    jobs.close()


def test_only_so_many_wait(jobs: Jobs, monkeypatch: pytest.MonkeyPatch):
    made = [jobs.submit(Task("about", {"recogniser": "base"})) for _ in range(module.WAITING_MAX)]
    with pytest.raises(BusyError, match="32 jobs wait already"):
        for _ in range(3):  # the worker may have taken one or two
            made.append(jobs.submit(Task("about", {"recogniser": "base"})))
    threading.Thread(target=jobs.close).start()
    assert all(each.ended.result(WAIT_S).is_over for each in made)
