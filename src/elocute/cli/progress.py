"""Progress: bars on the terminal and nothing anywhere else, and how far an interrupted run got."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator

from elocute.errors import Interrupted, printable


@contextlib.contextmanager
def progress_bar(label: str, quiet: bool = False) -> Iterator[Callable[[float], None]]:
    """A function that takes the share done (0…1); Interrupted tells the last one."""
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
    """A function to be called for each of `total` things done; Interrupted tells how many were."""
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
    """Around work that keeps what is done: Interrupted tells how to go on."""
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
        TextColumn("{task.description}", markup=False), BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"), TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(printable(label), total=1.0)
        yield lambda share: bar.update(task, completed=share)
