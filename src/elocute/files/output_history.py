"""What this tool wrote, and from what, so that the same command may replace its own files.

A small SQLite file in the user's state folder: `ELOCUTE_STATE` where that is set, else
`XDG_STATE_HOME/elocute` or `~/.local/state/elocute`, on macOS `~/Library/Application
Support/elocute`, on Windows `%LOCALAPPDATA%/elocute`. It holds paths, sizes and times, and stays on
this machine. Where it cannot be read or written, nothing is known, and every file that exists
counts as somebody else's.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import sqlite3

DATABASE_NAME = "outputs.sqlite3"
ROWS_MAX = 50_000
"""The oldest are forgotten: their files are then strangers' files, which is the safe side."""
WAIT_S = 2.0
_TABLE = (
    "CREATE TABLE IF NOT EXISTS outputs (id INTEGER PRIMARY KEY AUTOINCREMENT, "
    "path BLOB NOT NULL UNIQUE, source BLOB NOT NULL, state BLOB NOT NULL)"
)
Source = str | Path
_T = TypeVar("_T")


def state_folder() -> Path:
    """Where the history lies; it may be missing, and is not made."""
    named = os.environ.get("ELOCUTE_STATE")
    if named:
        return Path(named)
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData/Local") / "elocute"
    if sys.platform == "darwin":
        return Path.home() / "Library/Application Support/elocute"
    named = Path(os.environ.get("XDG_STATE_HOME", ""))
    base = named if named.is_absolute() else Path.home() / ".local/state"
    return base / "elocute"


def source_text(sources: Iterable[Source]) -> str:
    """Inputs as the history names them, a line each: files by their real path, texts as said."""
    return "\n".join(os.path.realpath(s) if os.path.lexists(s) else str(s) for s in sources)


def fingerprint(path: Path) -> str | None:
    """What changes with a file or with what a folder holds: sizes and times; None for nothing."""
    try:
        facts = os.lstat(path)
        if stat.S_ISREG(facts.st_mode):
            return f"{facts.st_size} {facts.st_mtime_ns}"
        if not stat.S_ISDIR(facts.st_mode):
            return "no file"
        inside = hashlib.sha256()
        for folder, folders, names in os.walk(path):
            folders.sort()
            for name in sorted([*folders, *names]):
                place = Path(folder, name)
                facts = place.lstat()
                state = (
                    "" if stat.S_ISDIR(facts.st_mode) else f"{facts.st_size} {facts.st_mtime_ns}"
                )
                inside.update(os.fsencode(place.relative_to(path)) + f"\0{state}\0".encode())
        return f"folder {inside.hexdigest()}"
    except OSError:
        return None if not os.path.lexists(path) else "unknown"


def remember_output(path: Path, sources: Iterable[Source], draft: Path | None = None) -> None:
    """Note that an output, as it is now, was made from `sources`; nothing happens where that fails.

    A draft is what is about to take its place. What is there counts too, until the next note, where
    it was made from the same: this process may be killed before the draft is there.
    """
    state, source = fingerprint(draft or path), source_text(sources)
    if state is None:
        return
    if draft is not None and recall_output(path) == (source, True):
        state = f"{state}\n{fingerprint(path)}"

    def note(table: sqlite3.Connection) -> None:
        table.execute(
            "INSERT OR REPLACE INTO outputs (path, source, state) VALUES (?, ?, ?)",
            (_key(path), os.fsencode(source), os.fsencode(state)),
        )
        table.execute(
            "DELETE FROM outputs WHERE id <= (SELECT max(id) FROM outputs) - ?", (ROWS_MAX,)
        )

    _with_history(note)


def recall_output(path: Path) -> tuple[str, bool] | None:
    """The text of an output's sources, and whether it is as it was made; None where unknown."""

    def ask(table: sqlite3.Connection) -> tuple[str, str] | None:
        row = table.execute(
            "SELECT source, state FROM outputs WHERE path = ?", (_key(path),)
        ).fetchone()
        return None if row is None else (os.fsdecode(row[0]), os.fsdecode(row[1]))

    known = _with_history(ask)
    return None if known is None else (known[0], fingerprint(path) in known[1].split("\n"))


def _key(path: Path) -> bytes:
    """The place that a rename would replace: links are followed on the way, not at the end."""
    return os.fsencode(Path(os.path.realpath(path.parent), path.name))


def _with_history(ask: Callable[[sqlite3.Connection], _T]) -> _T | None:
    """`ask` of the open history, begun anew where it is unreadable; None where there is none."""
    try:
        import sqlite3

        place = state_folder() / DATABASE_NAME
        place.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        if os.path.lexists(place) and not place.is_file():
            return None
    except (OSError, ImportError, RuntimeError, ValueError):
        return None
    for _ in range(2):
        try:
            with contextlib.closing(sqlite3.connect(place, timeout=WAIT_S)) as table, table:
                table.execute(_TABLE)
                return ask(table)
        except (sqlite3.OperationalError, TypeError, ValueError):
            return None  # locked, no room, read-only, or a home of another version
        except sqlite3.DatabaseError:  # damaged, or somebody else's: kept beside the new one
            with contextlib.suppress(OSError):
                os.link(place, place.with_name(place.name + ".unreadable"))
                place.unlink()
        except OSError:
            return None
    return None
