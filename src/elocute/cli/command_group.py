"""How every command explains itself: whole sentences in lists, and examples that can be copied."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from elocute.cli.examples import EXAMPLES
from elocute.cli.flags import RUNNING, in_flags
from elocute.cli.settings_options import expanded
from elocute.errors import ElocuteError, InputError


class ExplainedCommand(TyperCommand):
    """A command whose `--help` ends with its examples, and whose errors name its flags."""

    def __init__(self, *given: Any, **settings: Any) -> None:
        super().__init__(*given, **settings)
        for parameter in self.params:
            if getattr(parameter, "help", None):
                parameter.help = in_flags(parameter.help, self)  # type: ignore[attr-defined]

    def get_short_help_str(self, limit: int = 45) -> str:
        return first_paragraph(self.help)

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        write_examples(ctx, formatter)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        words = list(args)
        rest = super().parse_args(ctx, args)
        self._refuse_empty_names(ctx, words)
        return rest

    def _refuse_empty_names(self, ctx: Any, words: list[str]) -> None:
        """An empty name, as of a variable of the shell that is not set, would be the folder here.

        Raises InputError.
        """
        empty = any(not word or (word.startswith("--") and word.endswith("=")) for word in words)
        if "." in words or not empty:
            return
        for parameter in self.params:
            value = ctx.params.get(parameter.name or "")
            if Path() in (value if isinstance(value, list | tuple) else [value]):
                raise InputError.about(
                    f"{parameter.opts[-1]} ''",
                    found="no name",
                    allowed="the name of a file or a folder; . is this one",
                )

    def invoke(self, ctx: Any) -> Any:
        before = RUNNING.set(self)
        try:
            return super().invoke(ctx)
        except ElocuteError as error:
            error.args = (in_flags(str(error)),)
            raise
        finally:
            RUNNING.reset(before)


class ExplainedGroup(TyperGroup):
    """Commands under one name, which alone asks for their help."""

    def get_short_help_str(self, limit: int = 45) -> str:
        return first_paragraph(self.help)

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        write_examples(ctx, formatter)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if not args and not ctx.resilient_parsing:
            typer.echo(ctx.get_help())
            raise typer.Exit
        return super().parse_args(ctx, args)


class CommandGroup(typer.Typer):
    """typer.Typer with what holds for all commands here."""

    def __init__(self, help: str, **settings: Any) -> None:
        super().__init__(
            cls=ExplainedGroup,
            help=help,
            rich_markup_mode=None,
            pretty_exceptions_enable=False,
            **settings,
        )
        self.callback()(_no_options)

    def command(self, name: str | None = None, **settings: Any) -> Any:
        register = super().command(name, cls=ExplainedCommand, **settings)
        return lambda function: register(expanded(function))


def _no_options() -> None:
    """A group is one even where it holds a single command."""


def write_examples(ctx: Any, formatter: Any) -> None:
    """Past the formatter, which would break lines that are to be copied."""
    lines = EXAMPLES[ctx.command_path.partition(" ")[2]]
    formatter.write(f"\n{'Examples' if len(lines) > 1 else 'Example'}:\n")
    for line in lines:
        formatter.write(f"  elocute {line}\n")


def first_paragraph(text: str | None) -> str:
    return " ".join((text or "").partition("\n\n")[0].split())
