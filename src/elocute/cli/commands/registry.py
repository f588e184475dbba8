"""Which commands there are. The module of one is imported when it is asked for."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

COMMANDS = (
    "animate",
    "say",
    "live",
    "a2f",
    "phones",
    "cues",
    "render",
    "edit",
    "solve",
    "convert",
    "measure",
    "info",
    "doctor",
    "align",
    "evaluate",
    "head",
    "corpus",
    "capture",
    "blendshapes",
    "style",
    "train",
    "propagate",
    "words",
    "study",
    "studio",
)
"""In the order of the help. Each is a module beside this one, which holds either a group of
commands, `app`, or a function called as it is, such as `animate_command`."""


def command_module(name: str) -> ModuleType:
    return import_module(f"elocute.cli.commands.{name}")
