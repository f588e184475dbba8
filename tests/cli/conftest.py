"""`elocute` in this process: dozens of new ones would take their time."""

from __future__ import annotations

import contextlib
import io
import subprocess
import sys
from collections.abc import Callable
from unittest import mock

import pytest

from elocute.cli import main

Result = subprocess.CompletedProcess[str]


def run_here(*arguments: object) -> Result:
    """Run `elocute` and catch what it prints and how it leaves."""
    out, err = io.StringIO(), io.StringIO()
    with (
        mock.patch.object(sys, "argv", ["elocute", *map(str, arguments)]),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        pytest.raises(SystemExit) as left,
    ):
        main()
    return subprocess.CompletedProcess(arguments, left.value.code, out.getvalue(), err.getvalue())


@pytest.fixture(scope="session")
def run() -> Callable[..., Result]:
    """run("info", FILE): whatever comes of it."""
    return run_here


@pytest.fixture(scope="session")
def cli() -> Callable[..., Result]:
    """cli("info", FILE) succeeds and says nothing on stderr."""

    def run(*arguments: object) -> Result:
        result = run_here(*arguments)
        assert (result.returncode, result.stderr) == (0, ""), result.stderr
        return result

    return run


@pytest.fixture(scope="session")
def refused() -> Callable[..., None]:
    """refused("info", FILE, says="no such file") leaves with code 2 and one line."""

    def run(*arguments: object, says: str) -> None:
        result = run_here(*arguments)
        lines = result.stderr.strip().splitlines()
        assert (result.returncode, len(lines), result.stdout) == (2, 1, ""), result
        assert lines[0].startswith("elocute: ") and says in lines[0], lines[0]

    return run
