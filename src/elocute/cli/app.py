"""The commands together, each imported when it is asked for."""

from __future__ import annotations

import typer

from elocute.cli.command_group import CommandGroup
from elocute.cli.commands.registry import COMMANDS, command_module


def command_line(command: str = "") -> CommandGroup:
    """The program with all its commands, or with that one alone, which starts faster."""
    app = CommandGroup(
        "Speech in, 3D facial animation out.",
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_options)
    for name in (command,) if command in COMMANDS else COMMANDS:
        module = command_module(name)
        if hasattr(module, "app"):
            app.add_typer(module.app, name=name)
        else:
            app.command(name)(getattr(module, f"{name}_command"))
    return app


def _version(wanted: bool) -> None:
    if wanted:
        from elocute._version import __version__

        print(f"elocute {__version__}")
        raise typer.Exit


def _options(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version."
    ),
) -> None:
    """Speech in, 3D facial animation out."""
