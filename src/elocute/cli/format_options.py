"""Options of output formats on the command line: those that the registry of writers knows.

    def render_command(..., format_settings: FormatSettings = options_of_formats()) -> None:

The command is called with those that were given, by name, as `write` takes them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from elocute.cli.settings_options import option
from elocute.errors import InputError
from elocute.export.options import PictureOptions
from elocute.export.registry import WRITERS, check_suffix, format_options
from elocute.settings import Setting, settings_of, types_of

FormatSettings = dict[str, Any]
SIZES = {"720p": (1280, 720), "1080p": (1920, 1080), "4k": (3840, 2160)}
_KNOWN: dict[str, tuple[type, Any, Setting]] = {
    field.name: (each.options, field.default, about)
    for each in WRITERS.values()
    if each.options is not None
    for field, about in settings_of(each.options)
}
"""Every option of any format: its class, default and what is known of it."""
INTO = "into"
"""Beside options of formats: the file that takes are added to; a command says `add` so."""
SIZE = _KNOWN["size"][2]
SIZE_HELP = f"{SIZE.text} Written as 800, 1280x720, {', '.join(SIZES)}."

Size = typer.Option("800", help=SIZE_HELP)
Backend = option(PictureOptions, "backend")


def options_of_formats() -> Any:
    """The default of a parameter that stands for the options of all formats."""
    return _FormatSettingsGroup()


@dataclass(frozen=True)
class _FormatSettingsGroup:
    def options(self) -> dict[str, tuple[Any, Any]]:
        parameters: dict[str, tuple[Any, Any]] = {}
        for name, (cls, default, about) in _KNOWN.items():
            if name == "add":  # said by naming the file
                continue
            kind = str if name == "size" else types_of(cls)[name][0]
            text = SIZE_HELP if name == "size" else about.text
            shown = "800" if name == "size" else default
            text += f" [default: {shown}]" if isinstance(shown, str) else ""
            parameters[name] = (kind | None, typer.Option(None, help=text))
        return parameters

    def build(self, given: dict[str, Any]) -> FormatSettings:
        format_settings = {name: value for name, value in given.items() if value is not None}
        if "size" in format_settings:
            format_settings["size"] = parse_size(format_settings["size"])
        return format_settings


def check_format_settings(outputs: Iterable[Path], format_settings: FormatSettings) -> None:
    """Raise OutputError for an option that none of the outputs has, or a value that cannot be."""
    outputs = list(outputs)
    for target in outputs:
        format_options(target, settings_for_format(target, format_settings))
    for name, value in format_settings.items():
        if (
            name != INTO
            and outputs
            and not any(settings_for_format(target, {name: value}) for target in outputs)
        ):
            format_options(outputs[0], {name: value})


def settings_for_format(target: Path, format_settings: FormatSettings) -> FormatSettings:
    """The options among these that the format of `target` has."""
    known = WRITERS[check_suffix(target)].option_names()
    chosen = {name: value for name, value in format_settings.items() if name in known}
    return chosen | ({"add": True} if target == format_settings.get(INTO) else {})


def parse_size(text: str) -> tuple[int, int]:
    """Width and height in pixels. Raises InputError."""
    if text in SIZES:
        return SIZES[text]
    parts = text.lower().split("x")
    if len(parts) <= 2 and all(map(_is_side, parts)):
        return int(parts[0]), int(parts[-1])
    raise InputError.about(
        f"--size {text[:60]}",
        found="not a picture size",
        allowed=f"one number or WIDTHxHEIGHT, {SIZE.low:g} to {SIZE.high:g}, or {', '.join(SIZES)}",
    )


def _is_side(text: str) -> bool:
    """Whether it is a number of pixels; only so many digits are looked at."""
    low, high = SIZE.low or 0, SIZE.high or 0
    return (
        text.isascii()
        and text.isdecimal()
        and len(text) <= len(str(high))
        and low <= int(text) <= high
    )
