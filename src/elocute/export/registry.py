"""Which suffix is written by what."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

from elocute.errors import OutputError
from elocute.motion.motion import Motion

# suffix: (module beside this one, function); modules are imported when first needed.
WRITERS: dict[str, tuple[str, str]] = {
    ".npz": ("npz", "write_npz"),
    ".glb": ("gltf", "write_glb"),
    ".mp4": ("mp4", "write_mp4"),
    ".html": ("html", "write_html"),
    ".csv": ("arkit_csv", "write_csv"),
    ".json": ("curves_json", "write_json"),
    ".npy": ("meshes", "write_npy"),
    ".obj": ("meshes", "write_obj"),
    ".ply": ("meshes", "write_ply"),
    ".png": ("contact_sheet", "write_png"),
}
WITH_SOUND = (".mp4", ".glb", ".html")


def check_suffix(path: str | Path) -> str:
    """The suffix of `path`, in lower case. Raises OutputError for one that nothing writes."""
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
    suffix = check_suffix(path)
    if suffix == ".glb":
        options["overwrite"] = overwrite
    module, function = WRITERS[suffix]
    getattr(importlib.import_module(f"elocute.export.{module}"), function)(
        motion, Path(path), sound=sound, **options
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
