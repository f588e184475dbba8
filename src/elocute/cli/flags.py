"""Names of settings, as the library tells them in backticks, turned into flags.

The library says `fps` sets another; who typed a command reads --fps sets another.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextvars import ContextVar
from typing import Any

RUNNING: ContextVar[Any] = ContextVar("RUNNING", default=None)
"""The command that runs, whose flags are meant."""
_NAME = re.compile(r"`(\w+)`")


def in_flags(text: str, command: Any = None) -> str:
    """The text with the options of a command as flags: of the one that runs, if none is given.

    A name in backticks that is none of its options stays as it is.
    """
    if "`" not in text:
        return text
    command = command or RUNNING.get()
    flags = {} if command is None else dict(_flags(command.params))
    return _NAME.sub(lambda found: flags.get(found.group(1), found.group()), text)


def _flags(parameters: Iterable[Any]) -> Iterator[tuple[str, str]]:
    for parameter in parameters:
        for flag in parameter.opts:
            if flag.startswith("--"):
                yield parameter.name, flag
                if parameter.name == "into":  # which says of a .glb that takes are added
                    yield "add", flag
                break
