"""Which suffix is written by what, and what it may be told."""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from elocute.audio.waveform import Waveform
from elocute.errors import OutputError
from elocute.export.options import GlbOptions, HtmlOptions, PictureOptions
from elocute.motion.motion import Motion, check_motion
from elocute.numerics.input_checks import check_kind
from elocute.one_line_repr import brief


@dataclass(frozen=True)
class Format:
    """A writer, imported when first needed, and the class of its options, if it has any.

    has_sound    whether what is written carries the sound
    sound_beside whether the sound may be written beside it
    """

    module: str
    function: str
    options: type | None = None
    has_sound: bool = False
    sound_beside: bool = False

    def option_names(self) -> tuple[str, ...]:
        return tuple(each.name for each in fields(self.options)) if self.options else ()


WRITERS: dict[str, Format] = {
    ".npz": Format("npz", "write_npz"),
    ".glb": Format("gltf", "write_glb", GlbOptions, has_sound=True, sound_beside=True),
    ".mp4": Format("mp4", "write_mp4", PictureOptions, has_sound=True),
    ".html": Format("html", "write_html", HtmlOptions, has_sound=True),
    ".csv": Format("arkit_csv", "write_csv"),
    ".json": Format("curves_json", "write_json"),
    ".npy": Format("meshes", "write_npy"),
    ".obj": Format("meshes", "write_obj"),
    ".ply": Format("meshes", "write_ply"),
    ".png": Format("contact_sheet", "write_png", PictureOptions),
}


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


def format_options(path: str | Path, options: Mapping[str, Any]) -> Any:
    """The options of the format of `path`, None where it has none.

    Raises OutputError for an option that the format does not have, naming those it has, and for a
    value that cannot be.
    """
    suffix = check_suffix(path)
    known = WRITERS[suffix].option_names()
    for name in options:
        if name not in known:
            raise OutputError.about(
                path,
                found=f"`{name}` is no option of {suffix}",
                allowed=", ".join(f"`{each}`" for each in known) or "none",
            )
    cls = WRITERS[suffix].options
    return cls(**options) if cls else None


def write(
    motion: Motion,
    path: str | Path,
    *,
    sound: Any = None,
    overwrite: bool = False,
    progress: Callable[[float], None] | None = None,
    **options: Any,
) -> None:
    """Write a motion in the format that the suffix names.

    sound     a path or a Waveform
    options   those of the format, as `elocute.export.options` lists them

    A file of that name is replaced, a folder of meshes never; a NAME.wav beside NAME.glb with
    `overwrite`, or where it was made of this very sound. Raises OutputError, also for an option
    that the format does not have.
    """
    check_motion(motion)
    chosen = format_options(path, options)
    for name, value, kinds, allowed in (
        ("sound", sound, str | os.PathLike | Waveform | None, "a path, a Waveform or None"),
        ("overwrite", overwrite, bool, "True or False"),
        ("progress", progress, (Callable, type(None)), "a function or None"),
    ):
        check_kind(name, value, kinds, allowed, OutputError)
    known = WRITERS[check_suffix(path)]
    more: dict[str, Any] = {} if chosen is None else {"options": chosen}
    if known.sound_beside:
        more["overwrite"] = overwrite
    writer = getattr(importlib.import_module(f"elocute.export.{known.module}"), known.function)
    writer(motion, Path(path), sound=sound, progress=progress, **more)


def side_files(
    path: Path, sound: Any, *, embed_audio: bool = False, cut: bool = False
) -> list[Path]:
    """What `write` makes beside `path`; `cut` says that a part of the sound file is meant."""
    if not WRITERS[check_suffix(path)].sound_beside or sound is None or embed_audio:
        return []
    from elocute.export.gltf import wav_beside

    beside = path.with_suffix(".wav") if cut else wav_beside(path, sound)
    return [] if beside is None else [beside]
