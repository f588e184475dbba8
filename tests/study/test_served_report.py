"""A report of what was served from a study's folder, without a table between."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

pytest.importorskip("matplotlib")

from tests.support.commands import run_here
from tests.support.documented_files import answered

pytestmark = pytest.mark.slow


def test_what_was_served_is_reported(flashes: Path, tmp_path: Path) -> None:
    folder = tmp_path / "study"
    shutil.copytree(flashes, folder)
    answered(folder)
    done = run_here("study", "report", folder, "-o", tmp_path / "report")
    assert done.returncode == 0, done.stderr
    assert "people: 4 of 4" in done.stdout
    page = (tmp_path / "report/report.html").read_text(encoding="utf-8")
    assert "not the one that was served" not in done.stderr and "not known" not in page
    table = tmp_path / "answers.csv"
    assert run_here("study", "export", folder, "-o", table).returncode == 0
    (folder / "study.toml").write_text((folder / "study.toml").read_text() + "\n# later\n")
    words = ("study", "report", folder, "-o", tmp_path / "report", "--overwrite")
    done = run_here(*words)
    assert done.returncode == 2 and "another study.toml" in done.stderr
    done = run_here(*words, "--answers", table)
    assert done.returncode == 0 and "not the one that was served" in done.stderr
