"""Folders that long work fills, and goes on in where it was broken off."""

from __future__ import annotations

from pathlib import Path

from elocute.errors import OutputError

TRAINED = ("log.csv", "model.onnx")
"""What a training writes, after its checkpoint."""


def prepare_folder(folder: Path, resume: bool) -> None:
    """Make the folder, or take the one that is there. Raises OutputError."""
    from elocute.files.atomic import check_output

    check_output(folder)
    if folder.exists() and not folder.is_dir():
        raise OutputError.about(folder, found="a file", allowed="a folder")
    if folder.is_dir() and any(folder.iterdir()) and not resume:
        raise OutputError.about(
            folder, found="a folder with files in it", allowed="a new or empty folder",
            remedy="add --resume to go on in it",
        )  # fmt: skip
    folder.mkdir(exist_ok=True)


def prepare_training(folder: Path, resume: bool) -> None:
    """The same for a training, which goes on from a checkpoint. Raises OutputError."""
    prepare_folder(folder, resume)
    if (folder / "checkpoint.safetensors").exists():
        return
    for path in (folder / name for name in TRAINED):
        if path.exists():
            raise OutputError.about(
                path, found="no training made it: there is no checkpoint.safetensors beside it",
                allowed="a folder to go on in", remedy="choose another folder",
            )  # fmt: skip
