"""What is costly is made once a run of the tests, also where several workers ask at once."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from tests.support.once_a_run import once_a_run


class Factory:
    """A run's folder, as pytest gives it to each worker."""

    def __init__(self, run: Path, worker: str) -> None:
        self.base = run / worker
        self.base.mkdir()

    def getbasetemp(self) -> Path:
        return self.base


def test_workers_that_ask_at_once_get_one_folder(tmp_path: Path) -> None:
    made: list[Path] = []

    def make(folder: Path) -> None:
        made.append(folder)
        (folder / "corpus").write_text("whole")

    def ask(worker: int) -> Path:
        factory: Any = Factory(tmp_path, f"popen-gw{worker}")
        return once_a_run(factory, "learned", make)

    with ThreadPoolExecutor(4) as workers:
        folders = set(workers.map(ask, range(4)))
    assert folders == {tmp_path / "once" / "learned"} and len(made) == 1
    assert (made[0] / "corpus").read_text() == "whole"


def test_what_failed_is_tried_again_from_nothing(tmp_path: Path) -> None:
    factory: Any = Factory(tmp_path, "popen-gw0")

    def fail(folder: Path) -> None:
        (folder / "half").touch()
        raise ValueError("no room")

    with pytest.raises(ValueError, match="no room"):
        once_a_run(factory, "wild", fail)
    folder = once_a_run(factory, "wild", lambda folder: (folder / "whole").touch())
    assert [path.name for path in folder.iterdir()] == ["whole"]
