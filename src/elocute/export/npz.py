"""Writes the native format (.npz)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from elocute.export.options import NpzOptions
from elocute.motion.motion import Motion
from elocute.motion.store import save_motion


def write_npz(
    motion: Motion,
    path: str | Path,
    *,
    sound: object = None,
    options: NpzOptions | None = None,
    progress: Any = None,
) -> None:
    """Write a motion as .npz; the sound stays where it is. Raises OutputError."""
    save_motion(motion, path, with_head=options is None or not options.animation_only)
