"""What a training says: every epoch in a log, a line drawn anew on a terminal."""

from __future__ import annotations

import io

import pytest

from elocute.cli import progress
from elocute.cli.progress import EpochLines, logged_progress, progress_bar


class Terminal(io.StringIO):
    """Standard error that somebody watches."""

    def isatty(self) -> bool:
        return True


def train(lines: EpochLines, epochs: int = 3) -> None:
    """A training's reports: a hundred steps of hearing, then epochs."""
    for step in range(1, 101):
        lines(0.0, f"hearing the shards: {step}%")
    for epoch in range(1, epochs + 1):
        lines(epoch / epochs, f"epoch {epoch}: loss 0.5")


def test_a_log_holds_a_line_per_epoch(capsys: pytest.CaptureFixture[str]) -> None:
    train(EpochLines(quiet=False))
    assert capsys.readouterr().err.splitlines() == [
        "hearing the shards: 1%",
        " 33% epoch 1: loss 0.5",
        " 67% epoch 2: loss 0.5",
        "100% epoch 3: loss 0.5",
    ]


def test_long_hearing_is_told_now_and_then(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ten seconds a step: every third step is told."""
    clock = iter(range(0, 10_000, 10))
    monkeypatch.setattr(progress.time, "monotonic", lambda: float(next(clock)))
    train(EpochLines(quiet=False), epochs=1)
    assert len(capsys.readouterr().err.splitlines()) == 34 + 1


def test_a_terminal_shows_one_line_drawn_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Terminal()
    monkeypatch.setattr(progress.sys, "stderr", screen)
    monkeypatch.setattr(progress, "REDRAWN_S", 0.0)
    train(EpochLines(quiet=False), epochs=2)
    assert screen.getvalue().count("\n") == 2
    shown = [line.rsplit("\r", 1)[-1] for line in screen.getvalue().split("\n")[:-1]]
    assert shown == [" 50% epoch 1: loss 0.5", "100% epoch 2: loss 0.5"]


def test_machines_are_told_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    train(EpochLines(quiet=True))
    with progress_bar("measuring") as bar:
        bar(0.5)  # no terminal, no bar
    assert capsys.readouterr().err == ""


def test_work_of_unknown_length_is_told_in_a_log(capsys: pytest.CaptureFixture[str]) -> None:
    with logged_progress("fitting dcaw") as progress:
        for step in range(1, 41):
            progress(step / 40)
    assert capsys.readouterr().err == "fitting dcaw: 2%\n"
    with logged_progress("fitting dcaw", quiet=True) as progress:
        progress(0.5)
    assert capsys.readouterr().err == ""
