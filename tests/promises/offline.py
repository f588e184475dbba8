"""Runs `elocute` in this process while every step onto a network ends it.

    python -m tests.promises.offline COMMANDS.json

COMMANDS.json is a list of argument lists. Python reports each use of a socket to an audit hook;
the hook prints it and leaves at once, so that no code can swallow it.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

TOUCHES = ("socket.", "urllib.", "http.", "ftplib.", "smtplib.", "telnetlib.", "nntplib.")


def refuse(event: str, arguments: tuple[object, ...]) -> None:
    if event.startswith(TOUCHES):
        os.write(2, f"network: {event} {arguments}\n".encode())
        os._exit(99)


def main() -> None:
    commands = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    sys.addaudithook(refuse)
    from elocute.cli import main as elocute

    for command in commands:
        sys.argv = ["elocute", *command]
        try:
            elocute()
        except SystemExit as left:
            if left.code:
                sys.exit(f"{command}: {left.code}")


if __name__ == "__main__":
    main()
