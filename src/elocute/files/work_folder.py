"""Folders that long work fills, and in which it resumes where it was interrupted."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from elocute.errors import OutputError
from elocute.files.atomic import check_output

CHECKPOINT = "checkpoint.safetensors"
MODEL = "model.onnx"
TRAINED = ("log.csv", MODEL)
"""What a training writes, after its checkpoint."""


def prepare_folder(folder: Path, resume: bool) -> None:
    """Make a folder for long work, or, to resume, take the one that is there.

    Raises OutputError for a file, or a folder that is not empty where `resume` is not said.
    """
    check_output(folder)
    if folder.exists() and not folder.is_dir():
        raise OutputError.about(folder, found="a file", allowed="a folder")
    if folder.is_dir() and any(folder.iterdir()) and not resume:
        raise OutputError.about(
            folder,
            found="a folder with files in it",
            allowed="a new or empty folder",
            remedy="`resume` continues in it",
        )
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError.about(folder, found=f"cannot be made ({error.strerror})") from error


@contextlib.contextmanager
def no_empty_folder(folder: Path) -> Iterator[None]:
    """Around work that makes a folder: where it fails before a file is in it, the folder goes."""
    is_new = not os.path.lexists(folder)
    try:
        yield
    except BaseException:
        if is_new:
            remove_empty(folder)
        raise


def remove_empty(folder: Path) -> None:
    """Remove a folder and those in it as far as they hold no files."""
    for inner, _, _ in os.walk(folder, topdown=False):
        with contextlib.suppress(OSError):
            Path(inner).rmdir()


def prepare_work(folder: Path, resume: bool, mark: str, written: tuple[str, ...]) -> None:
    """As `prepare_folder`, for work whose folders are recognised by the first file written there.

    `mark` is a pattern of that file's name, `written` are patterns of names that are written later:
    without the mark, they are somebody else's. Raises OutputError as `prepare_folder`, and where
    somebody else's file would be replaced.
    """
    prepare_folder(folder, resume)
    if any(folder.glob(mark)):
        return
    for path in (path for pattern in written for path in sorted(folder.glob(pattern))):
        raise OutputError.about(
            path,
            found=f"nothing of Elocute made it: there is no {mark} beside it",
            allowed="a folder to continue in",
            remedy="choose another folder",
        )


def prepare_training(folder: Path, resume: bool) -> None:
    """As `prepare_work`, for a training, which resumes from its checkpoint."""
    prepare_work(folder, resume, CHECKPOINT, TRAINED)


def prepare_trainings(folder: Path, names: Iterable[str], resume: bool) -> None:
    """As `prepare_work`, for named trainings, each in a folder of its own, and their report.

    One that was not begun yet is begun.
    """
    prepare_work(folder, resume, f"*/{CHECKPOINT}", ("report.json",))
    for name in names:
        # One that was not begun yet is begun, whichever the others are at.
        prepare_training(folder / name, resume)
