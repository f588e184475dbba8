"""What project files are called, for commands that load nothing else."""

from __future__ import annotations

from pathlib import Path

SUFFIX = ".elocute.json"


def is_project(path: Path) -> bool:
    """Whether a file is named as projects are."""
    return path.name.lower().endswith(SUFFIX)


def project_name(path: Path) -> str:
    """The name of a project by its file."""
    return path.name[: -len(SUFFIX)]
