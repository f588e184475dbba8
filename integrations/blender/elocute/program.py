# SPDX-FileCopyrightText: 2026 Elocute contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Runs the installed program `elocute`: its command lines, its processes, and what it tells."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

NOT_FOUND = (
    "elocute is not found; install it (pip install elocute), or set its path in the preferences"
)


def find_program(path: str) -> str:
    """The program at a path, or of that name where the system looks. Raises OSError."""
    found = shutil.which(Path(path.strip() or "elocute").expanduser())
    if found is None:
        raise OSError(NOT_FOUND)
    return found


@dataclass(frozen=True)
class Wishes:
    """What a take is to be."""

    sound: str
    fps: float
    name: str  # of the take
    text: str = ""  # what is said; "" leaves it to the recording
    mood: str = ""  # "" for the program's own
    style: str = ""


def animate_command(program: str, wishes: Wishes, character: Path, take: Path) -> list[str]:
    """The command that writes a take of a character."""
    command = [program, "animate", wishes.sound, "--head", str(character), "-o", str(take)]
    command += ["--fps", f"{wishes.fps:.6f}", "--action", wishes.name]
    for option in ("text", "mood", "style"):
        value = getattr(wishes, option).strip()
        command += [f"--{option}", value] if value else []
    return command


def phones_command(program: str, wishes: Wishes, phones: Path) -> list[str]:
    """The command that writes the phones of a sound with their times."""
    text = ["--text", wishes.text.strip()] if wishes.text.strip() else []
    return [program, "phones", wishes.sound, "-o", str(phones), *text]


def mapping_command(program: str, character: Path) -> list[str]:
    """The command that tells what moves a character's shapes."""
    return [program, "info", str(character), "--json"]


@dataclass
class Run:
    """Commands, one after another; the first that fails ends them."""

    commands: list[list[str]]
    output: str = ""  # what the last one printed
    notes: list[str] = field(default_factory=list)  # lines that they told by the way
    error: str = ""  # in one line; "" where none failed
    _process: subprocess.Popen[str] | None = None

    def poll(self) -> bool:
        """Go on where a command ended; whether all is done."""
        if self._process is not None:
            if self._process.poll() is None:
                return False
            self._finish()
        if self.error or not self.commands:
            return True
        self._start(self.commands.pop(0))
        return bool(self.error)

    def wait(self) -> None:
        """Go on until all is done."""
        while not self.poll():
            if self._process is not None:
                self._process.wait()

    def stop(self) -> None:
        """End what runs."""
        self.commands.clear()
        if self._process is not None and self._process.poll() is None:
            self._process.kill()
            self._process.wait()
            self._close()

    def _start(self, command: Sequence[str]) -> None:
        # To files, not pipes: who polls would have to empty them.
        self._out, self._told = (
            tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115
            for _ in range(2)
        )
        # Blender's own Python is not the program's.
        kept = {name: each for name, each in os.environ.items() if not name.startswith("PYTHON")}
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=self._out,
                stderr=self._told,
                text=True,
                env=kept,
            )
        except OSError as problem:
            self.error = f"{command[0]}: {problem.strerror or problem}"
            self._close()

    def _close(self) -> None:
        self._out.close()
        self._told.close()

    def _finish(self) -> None:
        process, self._process = self._process, None
        for file in (self._out, self._told):
            file.seek(0)
        self.output = self._out.read()
        lines = [line for line in self._told.read().splitlines() if line.strip()]
        self._close()
        if process is not None and process.returncode:
            self.error = lines[-1] if lines else f"elocute ended with {process.returncode}"
        else:
            self.notes += lines


def mapping_rows(told: str) -> list[tuple[str, str, str]]:
    """Shape, state (moved, fitted, idle, unknown) and what of it, from `elocute info --json`.

    Raises ValueError for anything else.
    """
    record = json.loads(told)
    if not isinstance(record, dict) or record.get("kind") != "character":
        raise ValueError("no description of a character")
    rows = []
    for shape, what in record.get("mapped", {}).items():
        fitted = what.startswith("fitted")
        rows.append((shape, "fitted" if fitted else "moved", what.removeprefix("fitted, as ")))
    rows += [(shape, "idle", what) for shape, what in record.get("idle", {}).items()]
    rows += [(shape, "unknown", what) for shape, what in record.get("unknown", {}).items()]
    return rows


def phone_marks(told: str) -> list[tuple[float, str]]:
    """Start in seconds and name of each phone, from the JSON of `elocute phones`.

    Raises ValueError, KeyError or TypeError for anything else.
    """
    return [(float(each["start"]), str(each["phone"])) for each in json.loads(told)["phones"]]
