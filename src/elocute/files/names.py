"""Names of files that come from outside: one name, in one folder, on every system."""

from __future__ import annotations

import re
import stat
from pathlib import Path

from elocute.errors import InputError

# Names that Windows keeps for devices, whatever follows their first dot.
DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.I)
NAME_MAX, NAME_MAX_BYTES = 100, 180
"""Letters and bytes of a name: drafts and suffixes are added to it."""
_SIGNS = re.compile(r'[/\\:*?"<>|]')
ALLOWED = f'a plain name of up to {NAME_MAX} letters, without / \\ : * ? " < > |'


def checked_name(name: object, subject: str = "name") -> str:
    """A name that is one file in a folder, and could be so on any system.

    Raises InputError for a path, a hidden file, a device, and a name that is empty or too long.
    """
    if (
        not isinstance(name, str)
        or not 0 < len(name) <= NAME_MAX
        or not name.isprintable()
        or _SIGNS.search(name)
        or name[0] in ". ~-"
        or name[-1] in ". "
        or DEVICES.fullmatch(name)
        or len(name.encode("utf-8", "replace")) > NAME_MAX_BYTES
    ):
        raise InputError.about(subject, found=repr(name)[:80], allowed=ALLOWED)
    return name


def file_beside(folder: Path, name: object, subject: str = "name") -> Path:
    """The regular file of a name in a folder; a link is none, wherever it leads.

    Raises InputError as `checked_name`, and where no such file is there.
    """
    path = folder / checked_name(name, subject)
    try:
        is_regular = stat.S_ISREG(path.lstat().st_mode)
    except (OSError, ValueError):
        is_regular = False
    if not is_regular:
        raise InputError.about(
            subject, found=f"no file {path.name!r} in {folder}", allowed="a file of that folder"
        )
    return path
