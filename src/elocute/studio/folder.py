"""The projects of a folder: files by names that are checked, written whole, never one over another.

A project's revision is a digest of its file. Who saves says which revision was read; where the file
has become another since, nothing is written.
"""

from __future__ import annotations

import hashlib
import os
import threading
from pathlib import Path
from typing import Any

from elocute.errors import ElocuteError, InputError, OutputError
from elocute.files.media import SOUND_SUFFIXES
from elocute.files.names import checked_name, file_beside
from elocute.files.reading import read_bytes
from elocute.studio.project import PROJECT_FILE, Project, open_project, project_of
from elocute.studio.project_names import SUFFIX, is_project, project_name

LISTED_MAX = 2000


class ConflictError(InputError):
    """Something else is there, or was written there in the meantime."""


class StudioFolder:
    """The folder that a studio works in.

    Parameters
    ----------
    folder : Path
        It has to be there.

    Raises
    ------
    OutputError
        For anything but a folder that can be written.
    """

    def __init__(self, folder: Path) -> None:
        if not folder.is_dir() or not os.access(folder, os.W_OK):
            found = "a folder that cannot be written" if folder.is_dir() else "no such folder"
            raise OutputError.about(folder, found=found, allowed="a folder for projects")
        self.folder = Path(os.path.realpath(folder))
        self._lock = threading.Lock()

    def path(self, name: str) -> Path:
        """The file of a project, there or not. Raises InputError for a name that cannot be."""
        return self.folder / f"{checked_name(name, 'project')}{SUFFIX}"

    def existing(self, name: str) -> Path:
        """The file of a project that is there. Raises InputError."""
        return file_beside(self.folder, self.path(name).name, "project")

    def projects(self) -> list[dict[str, Any]]:
        """The projects, the latest first: name, text, sound, when changed (s since 1970)."""
        found = []
        for entry in self._files():
            if is_project(Path(entry.name)):
                facts = entry.stat(follow_symlinks=False)
                record = {"name": project_name(Path(entry.name)), "modified": facts.st_mtime}
                found.append(record | self._told(Path(entry.path)))
        return sorted(found, key=lambda each: -each["modified"])

    @staticmethod
    def _told(path: Path) -> dict[str, Any]:
        try:
            project = open_project(path)
        except ElocuteError as error:
            return {"text": None, "sound": None, "character": None, "error": str(error)}
        return {"text": project.text, "sound": project.sound, "character": project.character}

    def sounds(self) -> list[str]:
        """Sounds and videos that no project of the same name is of."""
        names = {entry.name for entry in self._files()}
        return sorted(
            name
            for name in names
            if name.lower().endswith(SOUND_SUFFIXES) and f"{Path(name).stem}{SUFFIX}" not in names
        )

    def named(self, suffixes: tuple[str, ...]) -> list[str]:
        """Files with one of these suffixes."""
        return sorted(e.name for e in self._files() if e.name.lower().endswith(suffixes))

    def _files(self) -> list[os.DirEntry[str]]:
        with os.scandir(self.folder) as entries:
            regular = [
                entry
                for entry in entries
                if entry.is_file(follow_symlinks=False) and not entry.name.startswith(".")
            ]
        return regular[:LISTED_MAX]

    def read(self, name: str) -> tuple[bytes, str]:
        """A project's file and its revision. Raises InputError."""
        data = read_bytes(self.existing(name), PROJECT_FILE)
        return data, revision_of(data)

    def save(self, name: str, data: bytes, revision: str) -> str:
        """Write a project that was read as a revision; the new revision.

        Raises InputError for what is no project, ConflictError where it is another by now.
        """
        project = project_of(data, self.folder, "project")
        project.check()
        with self._lock:
            path = self.existing(name)
            if revision_of(read_bytes(path, PROJECT_FILE)) != revision:
                raise ConflictError.about(
                    "project",
                    found="another revision: it was changed elsewhere in the meantime",
                    remedy="load it again",
                )
            return revision_of(project.save(path).encode())

    def create(self, name: str, project: Project) -> str:
        """Write a new project; its revision. Raises ConflictError where one is there."""
        with self._lock:
            path = self.path(name)
            if os.path.lexists(path):
                raise _taken(path)
            return revision_of(project.save(path).encode())

    def check_free(self, *paths: Path) -> None:
        """Raise ConflictError for a name that is taken."""
        for path in paths:
            if os.path.lexists(path):
                raise _taken(path)

    def take_in(self, draft: Path, name: str) -> Path:
        """Give a whole file of the same disk its name in the folder.

        Raises ConflictError where something is there, which stays.
        """
        path = self.folder / checked_name(name)
        with draft.open("r+b") as file:
            os.fsync(file.fileno())
        with self._lock:
            try:
                os.link(draft, path)  # unlike a rename, it never takes the place of another file
            except FileExistsError:
                raise _taken(path) from None
            except OSError:  # a file system without hard links
                self.check_free(path)
                draft.replace(path)
        return path


def revision_of(data: bytes) -> str:
    """What changes with a project's file."""
    return hashlib.sha256(data).hexdigest()[:16]


def _taken(path: Path) -> ConflictError:
    return ConflictError.about(
        path.name, found="exists already", remedy="rename one of them, or open the one that exists"
    )
