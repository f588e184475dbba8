"""Importers by the name of their format, and which of them a folder is for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from elocute.corpus.importers import biwi, vocaset
from elocute.corpus.importers.biwi import convert_biwi
from elocute.corpus.importers.folder import convert_folder
from elocute.corpus.importers.grid import convert_grid
from elocute.corpus.importers.import_report import Progress
from elocute.corpus.importers.split_choice import check_split_choice
from elocute.corpus.importers.vocaset import convert_vocaset
from elocute.corpus.length_units import parse_length_unit
from elocute.errors import CorpusError
from elocute.motion.motion import FPS_MAX

FORMATS = ("vocaset", "biwi", "folder", "grid")
FIXED_FPS = {"vocaset": vocaset.FPS, "biwi": biwi.FPS}
"""Frames a second that a format always has, and keeps."""


def detect_format(source: Path) -> str:
    """The format, of `FORMATS`, of a folder as others distribute it.

    Raises CorpusError where it is none of them.
    """
    if not source.is_dir():
        raise CorpusError.about(source, found="no folder", allowed="a folder of recordings")
    if (source / vocaset.FILES[0]).exists() or (source / vocaset.FILES[3]).exists():
        return "vocaset"
    if (source / "vertices_npy").is_dir():
        return "folder"
    if next((source / "clips").glob("*.npz"), None) or next(source.glob("*.npz"), None):
        return "grid"
    if next(source.glob("*/*/*.vl"), None) or next(source.glob("faces/*/*/*.vl"), None):
        return "biwi"
    raise CorpusError.about(
        source,
        found="no corpus that is known",
        allowed=", ".join(FORMATS),
        remedy="name its `format`",
    )


def convert(
    source: Path,
    output: Path,
    *,
    format: str | None = None,
    fps: float | None = None,
    texts: Path | None = None,
    leave_out: frozenset[str] = frozenset(),
    units: str | None = None,
    split: str | None = None,
    progress: Progress = None,
) -> list[str]:
    """Convert a folder of recordings into a corpus.

    Parameters
    ----------
    source : Path
        A folder as others distribute it.
    output : Path
        The corpus folder, new.
    format : str, optional
        One of `FORMATS`; recognised by its files by default.
    fps : float, optional
        Frames per second of a `folder`'s arrays (by default from the lengths of its sounds), or
        those that `grid` is resampled to (60).
    texts : Path, optional
        What is said, for `vocaset` and `folder`: .json {subject: {sentence: text}}, or lines of
        `subject TAB sentence TAB text`.
    leave_out : frozenset of str
        Names of subjects, or of clips as SUBJECT.SENTENCE (a file's name for `grid`).
    units : str, optional
        Of lengths in `biwi` and `folder`: mm, cm, dm, m, inch, or metres as a number; by default
        from the size of a head.
    split : str, optional
        As for `split_choice.choose_splits`; the published one by default, or an even one.
    progress : callable, optional
        Called with the share that is done, 0 to 1.

    Returns
    -------
    list of str
        A line for each thing that was assumed or skipped.

    Raises
    ------
    InputError
        For anything that cannot be used; nothing is written then.
    """
    if format is not None and format not in FORMATS:
        raise CorpusError.about(f"`format` {format}", found="unknown", allowed=", ".join(FORMATS))
    known = detect_format(source) if format is None else format
    if not source.is_dir():
        raise CorpusError.about(source, found="no folder", allowed="a folder of recordings")
    _check_options(known, fps, texts, units)
    check_split_choice(split)
    shared: dict[str, Any] = {"leave_out": leave_out, "split": split, "progress": progress}
    if known == "vocaset":
        return convert_vocaset(source, output, texts=texts, **shared)
    if known == "biwi":
        return convert_biwi(source, output, units=units, **shared)
    if known == "folder":
        return convert_folder(source, output, fps=fps, texts=texts, units=units, **shared)
    return convert_grid(source, output, fps=fps or 60.0, **shared)


def _check_options(known: str, fps: float | None, texts: Path | None, units: str | None) -> None:
    """Raise CorpusError for options that a format does not take."""
    if fps is not None and not 0 < fps <= FPS_MAX:
        raise CorpusError.about(f"`fps` {fps:g}", found="no frame rate", allowed="above 0 to 1000")
    if fps not in (None, FIXED_FPS.get(known, fps)):
        raise CorpusError.about(
            f"`fps` {fps:g}", found=f"{known} has {FIXED_FPS[known]:g}", allowed="folder, grid only"
        )
    if texts is not None and known not in ("vocaset", "folder"):
        raise CorpusError.about("`texts`", found=known, allowed="vocaset, folder")
    if units is not None:
        parse_length_unit(units)
        if known not in ("biwi", "folder"):
            raise CorpusError.about("`units`", found=known, allowed="biwi, folder")
