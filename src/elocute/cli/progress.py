"""Progress: bars and lines on the terminal; in a log, a line per epoch and few others; and how far
an interrupted run got."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator

from elocute.errors import Interrupted, printable


@contextlib.contextmanager
def progress_bar(label: str, quiet: bool = False) -> Iterator[Callable[[float], None]]:
    """A function that takes the share done (0…1); Interrupted names the last one."""
    done, draw = 0.0, None

    def watch(share: float) -> None:
        nonlocal done
        done = share
        if draw:
            draw(share)

    try:
        with _bar(label, quiet) as draw:
            yield watch
    except Interrupted as stop:
        raise Interrupted(str(stop) or f"{label}: {done:.0%} done") from None


@contextlib.contextmanager
def counted(total: int, what: str = "done") -> Iterator[Callable[[], None]]:
    """A function to be called for each of `total` things done; Interrupted says how many were."""
    done = 0

    def one() -> None:
        nonlocal done
        done += 1

    try:
        yield one
    except Interrupted as stop:
        raise Interrupted(str(stop) if total == 1 else f"{done} of {total} {what}") from None


@contextlib.contextmanager
def resumable(how: str) -> Iterator[None]:
    """Around work that keeps what is done: Interrupted says how to continue."""
    try:
        yield
    except Interrupted as stop:
        raise Interrupted(f"{stop}; {how}" if str(stop) else how) from None


@contextlib.contextmanager
def _bar(label: str, quiet: bool) -> Iterator[Callable[[float], None] | None]:
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(printable(label), total=1.0)
        yield lambda share: bar.update(task, completed=share)


@contextlib.contextmanager
def logged_progress(label: str, quiet: bool = False) -> Iterator[Callable[[float], None]]:
    """As `progress_bar`, with a line in a log at first and then every QUIET_S: for work that takes
    a second or minutes, nobody knows beforehand."""
    lines = EpochLines(quiet or sys.stderr.isatty())
    with progress_bar(label, quiet) as bar:

        def watch(share: float) -> None:
            bar(share)
            lines(0.0, f"{label}: {share:.0%}")

        yield watch


QUIET_S = 30.0
"""Steps before the first epoch appear in a log at most this often."""
REDRAWN_S = 0.1


class EpochLines:
    """A line for every epoch, none for machines; around a training, tells how far it got.

    Called with the share of all epochs done and a text. Texts at a share of zero are of steps
    before the first epoch ("encoding the corpus: 12%"), of which there are hundreds: a terminal
    shows them in one line that is drawn anew, a log the first of each kind and then one every
    QUIET_S.
    """

    def __init__(self, quiet: bool) -> None:
        self.quiet, self.terminal = quiet, sys.stderr.isatty()
        self._last, self._kind, self._told, self._open = "", "", float("-inf"), 0

    def __call__(self, share: float, line: str) -> None:
        if self.quiet or line == self._last:
            return
        self._last = line
        if share > 0:
            self._write(f"{share:4.0%} {line}", "\n")
            return
        kind, now = line.partition(":")[0], time.monotonic()
        pause = REDRAWN_S if self.terminal else QUIET_S
        if kind == self._kind and now - self._told < pause:
            return
        self._kind, self._told = kind, now
        self._write(line, "" if self.terminal else "\n")

    def __enter__(self) -> EpochLines:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if isinstance(error, Interrupted):
            raise Interrupted(f"{self._last or 'no epoch'} done; --resume continues") from None

    def _write(self, text: str, end: str) -> None:
        """Over the line that is still open, if one is."""
        start = f"\r{' ' * self._open}\r" if self._open else ""
        sys.stderr.write(f"{start}{text}{end}")
        sys.stderr.flush()
        self._open = 0 if end else len(text)
