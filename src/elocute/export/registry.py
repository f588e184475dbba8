"""Finds the writer and the options of each suffix."""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from elocute.errors import OutputError
from elocute.export.options import (
    ActionOptions,
    GlbOptions,
    HtmlOptions,
    NpzOptions,
    PictureOptions,
    ShapeOptions,
    VrmaOptions,
)
from elocute.one_line_repr import brief

if TYPE_CHECKING:  # the command line knows the formats without loading NumPy
    from elocute.audio.waveform import Waveform
    from elocute.head.model import HeadModel
    from elocute.motion.motion import Motion


@dataclass(frozen=True)
class Format:
    """A format: its writer, imported when first needed, and its options."""

    module: str  # of `elocute.export`, which writes it
    function: str  # the writer in that module
    options: type | None = None  # the settings dataclass of its options
    has_sound: bool = False  # whether what is written carries the sound
    sound_beside: bool = False  # whether the sound may be written beside it
    has_words: bool = False  # whether it shows words that are known
    has_alpha: bool = False  # whether it can leave out what lies behind the head
    has_mesh: bool = False  # whether it holds the head's own mesh

    @property
    def draws(self) -> bool:
        """Whether it shows the head, lit."""
        return self.options in (PictureOptions, HtmlOptions)

    def option_names(self) -> tuple[str, ...]:
        """The names of its options; () where it has none."""
        return tuple(each.name for each in fields(self.options)) if self.options else ()


WRITERS: dict[str, Format] = {
    ".npz": Format("npz", "write_npz", NpzOptions),
    ".glb": Format("gltf", "write_glb", GlbOptions, has_sound=True, sound_beside=True),
    ".fbx": Format("fbx", "write_fbx", ActionOptions, has_mesh=True),
    ".usdz": Format("usdz", "write_usdz", ShapeOptions, has_sound=True, has_mesh=True),
    ".vrm": Format("vrm", "write_vrm"),
    ".vrma": Format("vrm_animation", "write_vrma", VrmaOptions),
    ".mp4": Format("video", "write_video", PictureOptions, has_sound=True),
    ".webm": Format("video", "write_video", PictureOptions, has_sound=True, has_alpha=True),
    ".mov": Format("video", "write_video", PictureOptions, has_sound=True, has_alpha=True),
    ".html": Format("html", "write_html", HtmlOptions, has_sound=True, has_words=True),
    ".csv": Format("arkit_csv", "write_csv"),
    ".json": Format("curves_json", "write_json"),
    ".npy": Format("meshes", "write_npy", has_mesh=True),
    ".obj": Format("meshes", "write_obj", has_mesh=True),
    ".ply": Format("meshes", "write_ply", has_mesh=True),
    ".png": Format("pictures", "write_png", PictureOptions, has_alpha=True),
}
WITHOUT_SOUND_BESIDE = ("embed_audio", "animation_only", "add")
"""Options with one of which no sound lies beside a .glb: it is inside, or there are many takes."""
OWN_HEAD_OPTIONS = ("profile", "visemes", "web")
"""Options that say how a head of our own is written, beside which a character's file stays."""


def check_suffix(path: str | Path) -> str:
    """The suffix of an output.

    Parameters
    ----------
    path : str or Path
        The output.

    Returns
    -------
    str
        In lower case, with its dot: a key of `WRITERS`.

    Raises
    ------
    OutputError
        For a suffix that no format has.
    """
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
    """Options of the format that a suffix names, checked.

    Parameters
    ----------
    path : str or Path
        The output.
    options : mapping of str
        Values by name.

    Returns
    -------
    GlbOptions, HtmlOptions, PictureOptions, … or None
        None for a format without options.

    Raises
    ------
    OutputError
        For an option that the format does not have, naming those it has, and for a value out of
        range.
    """
    suffix = check_suffix(path)
    known = WRITERS[suffix].option_names()
    for name in options:
        if name not in known:
            raise OutputError.about(
                path,
                found=f"`{name}` is not an option of {suffix}",
                allowed=", ".join(f"`{each}`" for each in known) or "none",
            )
    cls = WRITERS[suffix].options
    chosen = cls(**options) if cls else None
    if isinstance(chosen, PictureOptions) and chosen.transparent and not WRITERS[suffix].has_alpha:
        able = ", ".join(name for name, each in WRITERS.items() if each.has_alpha)
        raise OutputError.about(
            path, found=f"a transparent background in {suffix}", allowed=f"one in {able}"
        )
    return chosen


def write(
    motion: Motion,
    path: str | Path,
    *,
    sound: str | os.PathLike[str] | Waveform | None = None,
    words: Sequence[tuple[float, float, str]] = (),
    overwrite: bool = False,
    progress: Callable[[float], None] | None = None,
    **options: Any,
) -> None:
    """Write a motion in the format that the suffix names.

    Parameters
    ----------
    motion : Motion
        What to write.
    path : str or Path
        The output. A file of that name is replaced, a folder of meshes never.
    sound : str, Path or Waveform, optional
        The sound that belongs to the motion.
    words : sequence of (float, float, str)
        Start in s, end in s and word, where they are known: captions of a format that has some.
    overwrite : bool
        Whether to replace a NAME.wav beside NAME.glb that was not made from this very sound.
    progress : callable, optional
        Called with the share that is done, 0 to 1.
    **options
        Those of the format: the fields of `GlbOptions`, `HtmlOptions` or `PictureOptions`.

    Raises
    ------
    MotionError
        For anything but a Motion.
    OutputError
        For an unknown suffix, an option that the format does not have, a format that the head has
        no mesh for, and a place that cannot be written.
    MachineError
        Where a picture is wanted and no renderer works.
    """
    from elocute.audio.waveform import Waveform
    from elocute.motion.motion import check_motion
    from elocute.numerics.input_checks import check_kind

    check_motion(motion)
    chosen = format_options(path, options)
    for name, value, kinds, allowed in (
        ("sound", sound, str | os.PathLike | Waveform | None, "a path, a Waveform or None"),
        ("words", words, tuple | list, "a list of (start, end, word)"),
        ("overwrite", overwrite, bool, "True or False"),
        ("progress", progress, (Callable, type(None)), "a function or None"),
    ):
        check_kind(name, value, kinds, allowed, OutputError)
    known = WRITERS[check_suffix(path)]
    check_character(motion.head, path, options)
    more: dict[str, Any] = {} if chosen is None else {"options": chosen}
    if known.sound_beside:
        more["overwrite"] = overwrite
    if known.has_words:
        more["words"] = words
    writer = getattr(importlib.import_module(f"elocute.export.{known.module}"), known.function)
    writer(motion, Path(path), sound=sound, progress=progress, **more)


def check_character(head: HeadModel, path: str | Path, options: Mapping[str, Any]) -> None:
    """Refuse what a head that stands for a character in its own file cannot be written as.

    Raises OutputError for such a head, where the format needs a mesh of our own or one of its
    options is for heads of our own.
    """
    suffix = check_suffix(path)
    if head.character is None:
        return
    for name in options:
        if name in OWN_HEAD_OPTIONS:
            raise OutputError.about(
                f"`{name}`",
                found=f"a head with shapes of its own ({head.character.name})",
                allowed="for the built-in head",
                remedy="leave it out",
            )
    if not WRITERS[suffix].has_mesh:
        return
    raise OutputError.about(
        path,
        found=f"{suffix} of {head.character.name}, whose mesh stays in its own file",
        allowed=" ".join(each for each, known in WRITERS.items() if not known.has_mesh),
    )


def side_files(
    path: Path, sound: Any, options: Mapping[str, Any], *, cut: bool = False
) -> list[Path]:
    """The files that `write` makes beside an output.

    options: of the formats; cut: whether only a part of the sound is meant, which cannot lie there
    already.
    """
    if not WRITERS[check_suffix(path)].sound_beside or sound is None:
        return []
    if any(options.get(name) for name in WITHOUT_SOUND_BESIDE):
        return []
    from elocute.export.gltf import wav_beside

    beside = path.with_suffix(".wav") if cut else wav_beside(path, sound)
    return [] if beside is None else [beside]
