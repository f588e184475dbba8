"""What every training does around its epochs: it resumes, keeps, logs and reports."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from torch import Tensor

from elocute.files.work_folder import CHECKPOINT
from elocute.training.checkpoint import check_checkpoint, save_checkpoint
from elocute.training.device import resolve_device
from elocute.training.training_log import Report, TrainingLog

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
            told = f"epoch {row['epoch']:.0f}: {describe(row)} ({row['seconds']:.1f} s)"
            report((epoch + 1) / epochs, told)
