"""Parses commands as their own programs would, without running them.

    python -m tests.promises.parse_commands < COMMANDS.json > PROBLEMS.json

COMMANDS.json is a list of argument lists that begin with `elocute` or the name of a module below
this project, as `python -m` takes it; PROBLEMS.json has, for each, an empty text or what its parser
said.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import io
import json
import runpy
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]


class ParsedError(Exception):
    """Arguments were accepted; the script shall do no more."""


def parse_and_stop(parser: argparse.ArgumentParser, *_: Any, **__: Any) -> None:
    namespace, extra = parser.parse_known_args(sys.argv[1:])
    if extra:
        parser.error(f"unrecognized arguments: {' '.join(extra)}")
    raise ParsedError(namespace)


def module_problem(module: str, arguments: list[str]) -> str:
    script = (ROOT / module.replace(".", "/")).with_suffix(".py")
    if not script.is_file():
        return f"no such module: {module}"
    if "argparse" not in script.read_text(encoding="utf-8"):
        return f"takes no arguments: {arguments}" if arguments else ""
    sys.argv, said = [str(script), *arguments], io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            runpy.run_module(module, run_name="__main__")
    except ParsedError:
        return ""
    except SystemExit:
        return said.getvalue().strip().splitlines()[-1]
    return "never parsed its arguments"


@functools.cache
def whole_command() -> Any:
    """`elocute` with all its commands, put together once."""
    import typer.main

    from elocute.cli.app import command_line

    return typer.main.get_command(command_line())


def elocute_problem(arguments: list[str]) -> str:
    command, context, rest = whole_command(), None, arguments
    try:
        while hasattr(command, "commands"):
            context = command.context_class(command, parent=context)
            if not rest or rest[0] not in command.commands:
                return f"no such command: elocute {' '.join(arguments)}"
            command, rest = command.commands[rest[0]], rest[1:]
        command.make_context(command.name, list(rest), parent=context)
    except Exception as problem:  # of click, or of a validation of ours
        return str(getattr(problem, "message", problem))
    return ""


def main() -> None:
    argparse.ArgumentParser.parse_args = parse_and_stop  # type: ignore[method-assign]
    found = []
    for program, *arguments in json.load(sys.stdin):
        if program == "elocute":
            found.append(elocute_problem(arguments))
        else:
            found.append(module_problem(program, arguments))
    json.dump(found, sys.stdout)


if __name__ == "__main__":
    main()
