"""What the command line says of itself."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from elocute.cli.app import command_line
from elocute.cli.examples import EXAMPLES
from tests.support import commands
from tests.support.commands import run_apart, run_python


def walk(command: Any, path: tuple[str, ...] = (), above: Any = None) -> Iterator[tuple]:
    context = command.make_context(
        path[-1] if path else "elocute", [], resilient_parsing=True, parent=above
    )
    yield path, command, context
    for name, below in getattr(command, "commands", {}).items():
        yield from walk(below, (*path, name), context)


WHOLE: Any = get_command(command_line())
EVERY = list(walk(WHOLE))
NAMES = [" ".join(path) for path, _, _ in EVERY]


@pytest.mark.parametrize("wide", [80, 200])
@pytest.mark.parametrize("name", NAMES)
def test_help_is_whole_sentences_with_examples(
    name: str, wide: int, cli: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(wide))
    text = cli(*name.split(), "--help").stdout
    assert not re.search(r"[a-z,]\.\.\.\n", text.partition("\n\n")[2]), text
    listed = re.search(r"^Commands:\n(.*?)\n\n", text, re.M | re.S)
    assert bool(listed) == any(other.startswith(f"{name} ".lstrip()) for other in NAMES if other)
    for entry in re.split(r"\n(?=  \w)", listed[1]) if listed else ():
        assert entry.rstrip().endswith("."), entry
    assert "\nExample" in text and "\n  elocute " in text
    for line in EXAMPLES[name]:
        assert f"  elocute {line}\n" in text  # whole, however long


def test_every_example_belongs_to_a_command() -> None:
    assert set(EXAMPLES) == set(NAMES)


@pytest.mark.parametrize(("name", "line"), [(n, e) for n, lines in EXAMPLES.items() for e in lines])
def test_an_example_is_a_command_that_exists(name: str, line: str) -> None:
    """Its options are understood, and a command's own examples are of that command."""
    words = shlex.split(line.split(" < ")[0].removesuffix(" --help"))
    assert line.startswith(name)
    command = WHOLE
    context = None
    while hasattr(command, "commands"):
        context = command.context_class(command, parent=context)
        command, words = command.commands[words[0]], words[1:]
    context = command.context_class(command, parent=context)
    if not line.endswith("--help"):
        command.parse_args(context, list(words))


@pytest.mark.parametrize(("path", "command"), [(p, c) for p, c, _ in EVERY])
def test_every_option_is_explained(path: tuple[str, ...], command: Any) -> None:
    assert command.help and command.help.rstrip().endswith(".")
    for parameter in command.params:
        assert getattr(parameter, "help", None), f"{path} {parameter.name}"


def test_a_name_alone_asks_for_help(cli: Callable[..., Any]) -> None:
    assert "Commands:" in cli().stdout
    assert cli("evaluate").stdout == cli("evaluate", "--help").stdout


def test_a_missing_argument_says_where_help_is(refused: Callable[..., None]) -> None:
    refused("animate", says="elocute animate --help")
    refused("sing", says="elocute --help")


def test_python_m_is_the_same_command() -> None:
    done = run_apart("head", check=True)
    assert done.stdout.startswith("Usage: elocute head") and not done.stderr


class TestCompletion:
    """In bash, as it is installed for a person."""

    @pytest.fixture
    def bash(self, tmp_path: Path) -> Callable[[str], str]:
        """Type into a bash of one's own that finds `elocute`."""
        bin_folder = tmp_path / "bin"
        bin_folder.mkdir()
        script = bin_folder / "elocute"
        script.write_text(f'#!/bin/sh\nexec {sys.executable} -m elocute "$@"\n')
        script.chmod(0o755)
        home = {"HOME": str(tmp_path), "PATH": f"{bin_folder}:{os.environ['PATH']}"}

        def typed(text: str) -> str:
            done = subprocess.run(
                ["bash", "--norc", "-c", text],
                env=os.environ | home,
                capture_output=True,
                text=True,
                check=True,
            )
            return done.stdout

        return typed

    def test_it_is_installed_and_completes(self, bash: Callable, tmp_path: Path) -> None:
        bash("elocute --install-completion; true")
        assert "elocute" in (tmp_path / ".bashrc").read_text()
        found = bash(
            "source ~/.bash_completions/elocute.sh; "
            "complete -p elocute; COMP_WORDS=(elocute an); COMP_CWORD=1; "
            '_elocute_completion elocute; echo "${COMPREPLY[@]}"; '
            "COMP_WORDS=(elocute animate --sty); COMP_CWORD=2; "
            '_elocute_completion elocute; echo "${COMPREPLY[@]}"'
        ).splitlines()
        assert "-o default" in found[0]  # files, where an option takes one
        assert found[1:] == ["animate", "--style"]

    def test_it_is_shown(self, bash: Callable) -> None:
        assert "_ELOCUTE_COMPLETE" in bash("elocute --show-completion; true")


@pytest.mark.parametrize(
    ("environment", "says"),
    [
        ({"_ELOCUTE_COMPLETE": "foo"}, "_ELOCUTE_COMPLETE: 'foo'; allowed: "),
        ({"_ELOCUTE_COMPLETE": "complete_csh"}, "_ELOCUTE_COMPLETE: 'complete_csh'; allowed: "),
        ({"_ELOCUTE_COMPLETE": "complete_bash"}, "no COMP_WORDS"),
        (
            {"_ELOCUTE_COMPLETE": "complete_bash", "COMP_WORDS": "a", "COMP_CWORD": "x"},
            "COMP_CWORD",
        ),
    ],
)
def test_what_no_shell_asks_is_one_line(environment: dict[str, str], says: str) -> None:
    commands.one_line(commands.run_apart("--help", env=commands.SAME_ELOCUTE | environment), says)


@pytest.mark.skipif(sys.platform != "linux", reason="a folder in which nobody can make another")
def test_completion_that_cannot_be_installed_is_one_line() -> None:
    code = (
        "import shellingham; from elocute.cli import main\n"
        "shellingham.detect_shell = lambda *_: ('bash', '/bin/bash')\n"
        "main()"
    )
    environment = commands.SAME_ELOCUTE | {"HOME": "/proc/x"}
    done = commands.run_python("-c", code, "--install-completion", env=environment)
    commands.one_line(done, "--install-completion: ", "/proc/x", code=1)


def test_all_commands_are_known_before_numpy_is() -> None:
    """Help comes at once: what takes long to import is imported by what needs it."""
    code = (
        "import sys; from typer.main import get_command;"
        "from elocute.cli.app import command_line; get_command(command_line());"
        "print([m for m in ('numpy', 'onnxruntime', 'av') if m in sys.modules])"
    )
    assert run_python("-c", code, check=True).stdout.strip() == "[]"
