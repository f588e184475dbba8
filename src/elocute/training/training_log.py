"""What a training reports: log.csv, events for TensorBoard, lines for people."""

from __future__ import annotations

import csv
import math
import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from elocute.errors import ModelError, OutputError
from elocute.files.atomic import write_atomically

VERSION = "brain.Event:2"
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
        self._write(file_version=VERSION)
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
