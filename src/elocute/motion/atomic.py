"""Files are written beside their name and renamed when whole."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from elocute.errors import OutputError


def check_output(path: str | Path) -> Path:
    """Return `path` as a Path whose folder exists and can be written.

    Raises OutputError where the folder is missing, is no folder, or denies writing; call it
    before long work so that nothing is computed for a place that cannot take it.
    """
    path = Path(path)
    folder = path.parent
    if not folder.is_dir():
        raise OutputError.about(
            path,
            found=f"folder {folder} does not exist",
            allowed="an existing folder",
            remedy=f"create it first: mkdir -p {folder}",
        )
    if not os.access(folder, os.W_OK):
        raise OutputError.about(
            path, found=f"folder {folder} cannot be written", remedy="choose another folder"
        )
    return path


@contextlib.contextmanager
def write_atomically(path: str | Path) -> Iterator[Path]:
    """Give a temporary path beside `path`; rename it there when the block ends without error.

    The temporary name keeps the suffix, since writers choose formats by it. Whatever the block
    left behind is removed when it fails or is interrupted. Raises OutputError as `check_output`.
    """
    path = check_output(path)
    if path.is_dir():
        raise OutputError.about(path, found="a folder", allowed="a file name")
    room = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
    try:
        yield room / path.name
        (room / path.name).replace(path)
    except OSError as error:
        raise OutputError.about(path, found=f"cannot be written ({error.strerror})") from error
    finally:
        shutil.rmtree(room, ignore_errors=True)


@contextlib.contextmanager
def write_folder_atomically(path: str | Path) -> Iterator[Path]:
    """Give a temporary folder beside `path`; rename it there when the block ends without error.

    An existing folder is refused, never emptied. Raises OutputError.
    """
    path = check_output(path)
    if path.exists():
        raise OutputError.about(
            path, found="exists already", allowed="a new folder", remedy="remove it or rename"
        )
    room = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
    try:
        yield room
        room.chmod(0o755)
        room.replace(path)
    except OSError as error:
        raise OutputError.about(path, found=f"cannot be written ({error.strerror})") from error
    finally:
        shutil.rmtree(room, ignore_errors=True)
