"""The library names settings; only the command line speaks of flags."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from elocute.cli.app import command_line
from elocute.cli.flags import in_flags
from tests.support.commands import run_apart


@pytest.mark.parametrize(
    ("command", "text", "told"),
    [
        ("corpus convert", "`fps` sets another", "--fps sets another"),
        ("corpus convert", "`leave_out` and `fps`", "--leave-out and --fps"),
        ("corpus convert", "`loudness`: none", "`loudness`: none"),
        (
            "train voca",
            "lower `learning_rate`, not `reduced`",
            "lower --learning-rate, not --reduced",
        ),
        ("train voca", "`batch_pairs`: 0", "--batch: 0"),
        ("edit", "`start` is after `stop`", "--from is after --to"),
    ],
)
def test_names_in_backticks_become_the_flags_of_a_command(
    command: str, text: str, told: str
) -> None:
    found: Any = get_command(command_line())
    for name in command.split():
        found = found.commands[name]
    assert in_flags(text, found) == told


def test_outside_of_any_command_a_text_stays_as_it_is() -> None:
    assert in_flags("`fps` sets another") == "`fps` sets another"


def test_an_error_of_the_library_reaches_the_command_line_with_its_flag(tmp_path: Path) -> None:
    words = ["train", "crnn", tmp_path, tmp_path, "-o", tmp_path / "out", "--highest-hz", "1"]
    done = run_apart(*words)
    assert done.returncode == 2
    assert done.stderr == "elocute: --highest-hz: 1; allowed: 1000 to 22050 Hz\n"
