"""Folders that long work fills, and goes on in where it was broken off."""

from __future__ import annotations

from pathlib import Path

from elocute.errors import OutputError


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
