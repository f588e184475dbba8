"""What every training does around its epochs: it resumes, keeps, logs and reports."""

from __future__ import annotations

import csv
import math
import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from torch import Tensor

from elocute.errors import ModelError, OutputError
from elocute.files.atomic import write_atomically
from elocute.files.work_folder import CHECKPOINT
from elocute.training.checkpoint import check_checkpoint, save_checkpoint
from elocute.training.device import resolve_device

EVENTS_VERSION = "brain.Event:2"  # of TensorBoard's files
Report = Callable[[float, str], None]
"""Called with the share of a training that is done, and a line for people."""


class TrainingLog:
    """The log of one training in its folder.

    fields: columns, the first of them the epoch. done: epochs that an earlier run has logged.
    Raises OutputError where a file cannot be written. Events are written at once: TensorBoard's
    own writer has a thread, whose failure would be a traceback of its own.
    """

    def __init__(self, folder: Path, fields: Sequence[str], done: int) -> None:
        from tensorboard.compat.proto.event_pb2 import SessionLog  # pyright: ignore

        self.folder, self.fields = folder, tuple(fields)
        stamp = f"{time.time():.6f}.{os.getpid()}"
        self.events = folder / "events" / f"events.out.tfevents.{stamp}"
        try:
            self.events.parent.mkdir(exist_ok=True)
        except OSError as error:
            raise self._refused(error) from error
        self._write(file_version=EVENTS_VERSION)
        # TensorBoard then drops the later epochs of a run that was interrupted.
        self._write(step=done, session_log=SessionLog(status=SessionLog.START))

    def add(self, log: Sequence[dict[str, float]]) -> None:
        """Rewrite the whole table, and append its last row as an event."""
        from tensorboard.compat.proto.summary_pb2 import Summary  # pyright: ignore

        with (
            write_atomically(self.folder / "log.csv") as draft,
            draft.open("w", newline="", encoding="utf-8") as file,
        ):
            rows = csv.DictWriter(file, self.fields)
            rows.writeheader()
            rows.writerows(log)
        last = log[-1]
        values = [
            Summary.Value(tag=name, simple_value=float(last[name])) for name in self.fields[1:]
        ]
        self._write(step=int(last[self.fields[0]]), summary=Summary(value=values))

    def _write(self, **event: Any) -> None:
        from tensorboard.compat.proto.event_pb2 import Event  # pyright: ignore
        from tensorboard.summary.writer.record_writer import RecordWriter

        record = Event(wall_time=time.time(), **event).SerializeToString()
        try:
            with self.events.open("ab") as file:
                RecordWriter(file).write(record)
        except OSError as error:
            raise self._refused(error) from error

    def _refused(self, error: OSError) -> OutputError:
        return OutputError.about(self.events, found=f"cannot be written ({error.strerror})")


def check_loss(loss: float, epoch: int, remedy: str) -> None:
    """Raise ModelError where the loss of an epoch (the first is 0) is not finite."""
    if not math.isfinite(loss):
        raise ModelError.about(
            "training", found=f"a loss of {loss} in epoch {epoch + 1}", remedy=remedy
        )


Row = dict[str, float]


def open_folder(folder: str | Path, device: str, *, resume: bool) -> Path:
    """The folder of a training, made; what would stop the training is said before hours are spent.

    Raises ModelError for a device that is missing and a checkpoint that cannot be read.
    """
    folder = Path(folder)
    folder.mkdir(exist_ok=True)
    resolve_device(device)
    if resume:
        check_checkpoint(folder)
    return folder


def checkpoint_to_resume(folder: Path | None, resume: bool) -> Path | None:
    """The checkpoint that a training goes on from; None where it starts anew."""
    path = folder / CHECKPOINT if folder and resume else None
    return path if path and path.exists() else None


def run_epochs(
    log: list[Row],
    epochs: int,
    train: Callable[[int], Row],
    state: Callable[[], dict[str, Tensor]],
    *,
    folder: Path | None,
    fields: Sequence[str],
    record: dict[str, Any],
    describe: Callable[[Row], str],
    report: Report | None,
) -> None:
    """Train for the epochs that are left, and keep what each of them gave.

    log: a row for each epoch that is done; one is added for each that follows. train: called with
    the number of an epoch, gives what it measured. state, record: what the checkpoint holds, beside
    the log. fields: columns of log.csv. describe: what people are told of a row.
    """
    logger = TrainingLog(folder, fields, len(log)) if folder else None
    for epoch in range(len(log), epochs):
        begun = time.perf_counter()
        row = {"epoch": epoch + 1.0, **train(epoch)}
        row["seconds"] = time.perf_counter() - begun
        log.append(row)
        if folder and logger:
            save_checkpoint(folder / CHECKPOINT, state(), {**record, "log": log})
            logger.add(log)
        if report:
            line = f"epoch {row['epoch']:.0f}: {describe(row)} ({row['seconds']:.1f} s)"
            report((epoch + 1) / epochs, line)
