"""How tests run a command: in this process, or in one of its own. There is no third way.

`run_here` is quick and enough for what a command says and writes. A process of its own, by
`run_apart`, is for what only a real one shows: start-up, pipes, signals, a full disk.
"""

from __future__ import annotations

import contextlib
import io
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

import elocute
from elocute.cli import main
from elocute.cli.entry_point import ENDINGS

Result = subprocess.CompletedProcess[str]
TIMEOUT_S = 300
SAME_ELOCUTE = os.environ | {"PYTHONPATH": str(Path(elocute.__file__).parents[1])}
"""An environment in which every Python finds the package that is tested, wherever it starts."""


def run_here(*arguments: object) -> Result:
    """Run `elocute` here and catch what it prints and how it leaves."""
    words = ["elocute", *texts(*arguments)]
    out, err = io.StringIO(), io.StringIO()
    with (
        mock.patch.object(sys, "argv", words),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        pytest.raises(SystemExit) as left,
        _signals_as_before(),
    ):
        main()
    code = left.value.code
    assert isinstance(code, int), code
    return subprocess.CompletedProcess(words, code, out.getvalue(), err.getvalue())


@contextlib.contextmanager
def _signals_as_before() -> Iterator[None]:
    """A command that has ended ignores signals, and so would all that this process starts."""
    before = {number: signal.getsignal(number) for number in ENDINGS}
    try:
        yield
    finally:
        for number, handler in before.items():
            if signal.getsignal(number) is not handler:
                signal.signal(number, handler)


def run_apart(*arguments: object, **options: Any) -> Result:
    """Run `elocute` in a process of its own; options are those of subprocess.run."""
    return run_python("-m", "elocute", *arguments, **options)


def run_python(*words: object, **options: Any) -> Result:
    """Run this Python: run_python("-c", CODE, ARGUMENT), run_python("-m", MODULE)."""
    return subprocess.run(python(*words), text=True, **(_caught() | options))


def run_bytes(*arguments: object, **options: Any) -> subprocess.CompletedProcess[bytes]:
    """As run_apart, for what goes in and comes out as bytes."""
    return subprocess.run(python("-m", "elocute", *arguments), **(_caught() | options))


def python(*words: object) -> list[str]:
    """The words that start this Python, where a test must talk to the process itself."""
    return [sys.executable, *texts(*words)]


def texts(*words: object) -> list[str]:
    """Words of a command line from paths, numbers, and names of files in bytes."""
    return [os.fsdecode(word) if isinstance(word, bytes) else str(word) for word in words]


def _caught() -> dict[str, Any]:
    return {
        "stdout": subprocess.PIPE,
        "stderr": subprocess.PIPE,
        "timeout": TIMEOUT_S,
        "check": False,
    }


def one_line(result: Result, *says: str, code: int = 2) -> str:
    """The command failed with one clear line and no traceback; gives the line."""
    lines = result.stderr.strip().splitlines()
    assert (result.returncode, len(lines)) == (code, 1), result.stderr
    assert lines[0].startswith("elocute: "), lines[0]
    for words in says:
        assert words in lines[0], lines[0]
    return lines[0]


def refused(*arguments: object, says: str | tuple[str, ...] = ()) -> None:
    """refused("info", FILE, says="no such file") leaves with code 2, one line and no output."""
    result = run_here(*arguments)
    one_line(result, *((says,) if isinstance(says, str) else says))
    assert result.stdout == ""


def succeeds(*arguments: object) -> Result:
    """succeeds("info", FILE) leaves with code 0 and says nothing on stderr.

    But that nobody speaks, where a test takes noise for a sound.
    """
    result = run_here(*arguments)
    told = [line for line in result.stderr.splitlines() if "no speech heard" not in line]
    assert (result.returncode, told) == (0, []), result.stderr
    return result
