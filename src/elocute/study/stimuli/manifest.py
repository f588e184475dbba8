"""The folder of a study: its file, its videos, and a manifest of them with checksums."""

from __future__ import annotations

import contextlib
import hashlib
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from elocute.errors import StudyError
from elocute.files.json_records import finite_number, read_record, write_record
from elocute.files.reading import open_regular
from elocute.study.design.design import Design, StimulusSound
from elocute.study.design.design_file import read_design
from elocute.study.design.trials import all_videos
from elocute.study.stimuli.sources import with_found_sounds

FORMAT = "elocute study"
NAME, DESIGN, VIDEOS, PAIRS = "manifest.json", "study.toml", "videos", "pairs"
FILE_MAX_BYTES = 100_000_000
ALLOWED = "the manifest of a study, as `elocute study new` writes it"


@dataclass(frozen=True)
class Video:
    """One video of a study.

    Attributes
    ----------
    name : str
        Of its clip or pair, as `trials` names them.
    file : str
        Below the folder.
    sha256 : str
        Of the file, hexadecimal.
    size : int
        Bytes.
    key : str
        A digest of all that it was made from.
    seconds : float
        Its length.
    luma : float
        Mean brightness, 0 to 255.
    """

    name: str
    file: str
    sha256: str
    size: int
    key: str
    seconds: float
    luma: float


@dataclass(frozen=True)
class Manifest:
    """What a study's folder holds.

    Attributes
    ----------
    design_sha256 : str
        Of the study.toml that it was made from.
    sounds : tuple of StimulusSound
        Those that the file names, patterns resolved.
    videos : dict of str to Video
        By name.
    notes : tuple of str
        What to know about them: brightness that differs, for example.
    """

    design_sha256: str
    sounds: tuple[StimulusSound, ...]
    videos: dict[str, Video] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def write(self, folder: Path) -> None:
        """Write it into a folder. Raises OutputError."""
        write_record(
            folder / NAME,
            {
                "format": FORMAT,
                "version": 1,
                "design_sha256": self.design_sha256,
                "sounds": [asdict(each) for each in self.sounds],
                "videos": [asdict(each) for each in self.videos.values()],
                "notes": list(self.notes),
            },
            indent=1,
        )


@dataclass(frozen=True)
class StudyFolder:
    """A study that is ready to be served.

    Attributes
    ----------
    folder : Path
        Where it is.
    design : Design
        Its file, with every sound by name.
    manifest : Manifest
        Its videos.
    """

    folder: Path
    design: Design
    manifest: Manifest

    def check_videos(self) -> None:
        """Raise StudyError unless every video that somebody may see is there as it was made."""
        clips, pairs = all_videos(self.design)
        for name in [each.name for each in (*clips, *pairs)]:
            video = self.manifest.videos.get(name)
            path = self.folder / (video.file if video else f"{VIDEOS}/{name}.mp4")
            if video is None or not path.is_file() or file_sha256(path) != video.sha256:
                raise StudyError.about(
                    path,
                    found="missing, or another file than was made",
                    allowed="every video of the study",
                    remedy="`elocute study new` makes it",
                )


def file_sha256(path: Path) -> str:
    """SHA-256 of a file, hexadecimal. Raises StudyError where it cannot be read."""
    digest = hashlib.sha256()
    with open_regular(path, max_bytes=2**40, allowed="a file", error=StudyError) as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def read_manifest(folder: Path) -> Manifest:
    """Read the manifest of a study.

    Parameters
    ----------
    folder : Path
        The study's folder.

    Returns
    -------
    Manifest

    Raises
    ------
    StudyError
        For a file that is missing or something else.
    """
    path = folder / NAME
    record = read_record(path, max_bytes=FILE_MAX_BYTES, allowed=ALLOWED, error=StudyError)
    try:
        if record["format"] != FORMAT or record["version"] != 1:
            raise ValueError("another format or version")
        sounds = tuple(_sound(each) for each in record["sounds"])
        videos = [_video(each) for each in record["videos"]]
        notes = tuple(str(each) for each in record["notes"])
        return Manifest(str(record["design_sha256"]), sounds, {v.name: v for v in videos}, notes)
    except (KeyError, TypeError, ValueError) as problem:
        raise StudyError.about(
            path, found=f"no such manifest ({problem})", allowed=ALLOWED
        ) from None


def _sound(record: dict[str, Any]) -> StimulusSound:
    return StimulusSound(**{**record, "choices": tuple(record["choices"])})


def _video(record: dict[str, Any]) -> Video:
    video = Video(**record)
    numbers = [finite_number(each) for each in (video.size, video.seconds, video.luma)]
    texts = (video.name, video.file, video.sha256, video.key)
    if None in numbers or not all(isinstance(each, str) for each in texts):
        raise ValueError(f"video {video.name!r}")
    first, *rest = Path(video.file).parts
    if first not in (VIDEOS, PAIRS) or len(rest) != 2 or ".." in rest:
        raise ValueError(f"file {video.file!r}")
    return video


def open_study(folder: str | Path) -> StudyFolder:
    """Open the folder of a study.

    Parameters
    ----------
    folder : str or Path
        What `elocute study new` made.

    Returns
    -------
    StudyFolder

    Raises
    ------
    StudyError
        For a folder that is none, or whose file was changed since its videos were made.
    """
    folder = Path(folder)
    manifest = read_manifest(folder)
    design = read_design(folder / DESIGN)
    if design.sha256 != manifest.design_sha256:
        raise StudyError.about(
            folder / DESIGN,
            found="another study than its videos were made for",
            allowed="the file as it was",
            remedy="`elocute study new` makes a folder of the changed one",
        )
    stimuli = replace(design.stimuli, sounds=manifest.sounds)
    return StudyFolder(folder, replace(design, stimuli=stimuli), manifest)


def known_design(
    study: str | Path, data: Path | None = None, *, elsewhere: bool = False
) -> tuple[Design, str]:
    """A study, rendered or not.

    Parameters
    ----------
    study : str or Path
        Its folder, or its file; beside a manifest its sounds are those of the manifest.
    data : Path, optional
        Where the names in the file begin, for patterns of sounds; by default its own folder.
    elsewhere : bool
        Whether its sounds may be somewhere else: a pattern that nothing fits then stays one.

    Returns
    -------
    design : Design
        The study.
    served_sha256 : str
        SHA-256 of the file that its videos were made of; "" where there are none.

    Raises
    ------
    StudyError
        For files that cannot be read, and a pattern that nothing fits.
    """
    study = Path(study)
    design, folder = read_design(study), study if study.is_dir() else study.parent
    if not (folder / NAME).is_file():
        with contextlib.suppress(*([StudyError] if elsewhere else [])):
            return with_found_sounds(design, data or folder), ""
        return design, ""
    manifest = read_manifest(folder)
    stimuli = replace(design.stimuli, sounds=manifest.sounds)
    return replace(design, stimuli=stimuli), manifest.design_sha256
