"""Which suffix is written by what."""

from __future__ import annotations

import importlib
import inspect
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from elocute.audio.waveform import Waveform
from elocute.errors import OutputError
from elocute.motion.motion import Motion, check_motion
from elocute.one_line_repr import brief

# suffix: (module, function); modules are imported when first needed.
WRITERS: dict[str, tuple[str, str]] = {
    ".npz": ("elocute.export.npz", "write_npz"),
    ".glb": ("elocute.export.gltf", "write_glb"),
    ".mp4": ("elocute.export.mp4", "write_mp4"),
    ".html": ("elocute.export.html", "write_html"),
    ".csv": ("elocute.export.arkit_csv", "write_csv"),
    ".json": ("elocute.export.curves_json", "write_json"),
    ".npy": ("elocute.export.meshes", "write_npy"),
    ".obj": ("elocute.export.meshes", "write_obj"),
    ".ply": ("elocute.export.meshes", "write_ply"),
    ".png": ("elocute.export.contact_sheet", "write_png"),
}
_FIRST, _OURS = ("motion", "path"), ("sound", "overwrite")
_KINDS: dict[str, Any] = {
    "sound": str | os.PathLike | Waveform | None,
    "title": str | None,
    "progress": (Callable, type(None)),
    "embed_audio": bool,
    "overwrite": bool,
}
_ALLOWED = {
    "sound": "a path, a Waveform or None",
    "title": "text",
    "progress": "a function",
    "embed_audio": "True or False",
    "overwrite": "True or False",
}
WITH_SOUND = (".mp4", ".glb", ".html")


def check_suffix(path: str | Path) -> str:
    """The suffix of `path`, in lower case. Raises OutputError for one that nothing writes."""
    if not isinstance(path, str | os.PathLike):
        raise OutputError.about("path", found=brief(path), allowed="the name of a file")
    suffix = Path(path).suffix.lower()
    if suffix not in WRITERS:
        raise OutputError.about(
            path,
            found=f"suffix {suffix!r}" if suffix else "no suffix",
            allowed=" ".join(WRITERS),
            remedy="choose one of these",
        )
    return suffix


def write(
    motion: Motion, path: str | Path, *, sound: Any = None, overwrite: bool = False, **options: Any
) -> None:
    """Write a motion in the format that the suffix names.

    `sound` is a path or a Waveform; options are those of the writer. A file of that name is
    replaced, a folder of meshes never; a NAME.wav beside NAME.glb with `overwrite`, or where it
    was made of this very sound. Raises OutputError.
    """
    check_motion(motion)
    suffix = check_suffix(path)
    if suffix == ".glb":
        options["overwrite"] = overwrite
    module, function = WRITERS[suffix]
    writer = getattr(importlib.import_module(module), function)
    _check_options(path, writer, {**options, "sound": sound})
    writer(motion, Path(path), sound=sound, **options)


def _check_options(path: str | Path, writer: Any, options: dict[str, Any]) -> None:
    """Raise OutputError for an option that the writer has not, or of another kind."""
    known = [name for name in inspect.signature(writer).parameters if name not in _FIRST]
    for name, value in options.items():
        if name not in known:
            allowed = ", ".join(name for name in known if name not in _OURS)
            raise OutputError.about(
                path, found=f"option {brief(name)}", allowed=allowed or "no options"
            )
        if name in _KINDS and not isinstance(value, _KINDS[name]):
            raise OutputError.about(
                path, found=f"{name} is {brief(value)}", allowed=f"{name} is {_ALLOWED[name]}"
            )


def side_files(
    path: Path, sound: Any, *, embed_audio: bool = False, cut: bool = False
) -> list[Path]:
    """What `write` makes beside `path`; `cut` says that a part of the sound file is meant."""
    if path.suffix.lower() != ".glb" or sound is None or embed_audio:
        return []
    from elocute.export.gltf import wav_beside

    beside = path.with_suffix(".wav") if cut else wav_beside(path, sound)
    return [] if beside is None else [beside]
