"""The folder of a study: its file, its videos, and a manifest of them with checksums."""

from __future__ import annotations

import contextlib
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from elocute.errors import StudyError
from elocute.files.json_records import finite_number, read_record, write_record
from elocute.files.reading import FileKind, file_sha256
from elocute.study.design.design import Design, StimulusSound
from elocute.study.design.design_file import read_design
from elocute.study.design.trials import all_videos
from elocute.study.stimuli.sources import with_found_sounds

FORMAT = "elocute study"
NAME, DESIGN, VIDEOS, PAIRS = "manifest.json", "study.toml", "videos", "pairs"
MANIFEST_FILE = FileKind(
    "the manifest of a study, as `elocute study new` writes it", 100_000_000, StudyError
)


@dataclass(frozen=True)
class Video:
    """One video of a study."""

    name: str  # of its clip or pair, as `trials` names them
    file: str  # below the folder
    sha256: str  # of the file, hexadecimal
    size: int  # bytes
    key: str  # a digest of all that it was made from
    seconds: float  # its length
    luma: float  # mean brightness, 0 to 255


@dataclass(frozen=True)
class Manifest:
    """What a study's folder holds."""

    design_sha256: str  # of the study.toml that it was made from
    sounds: tuple[StimulusSound, ...]  # those that the file names, patterns resolved
    videos: dict[str, Video] = field(default_factory=dict)  # by name
    notes: tuple[str, ...] = ()  # what to know about them: brightness that differs, for example

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
    """A study that is ready to be served."""

    folder: Path  # where it is
    design: Design  # its file, with every sound by name
    manifest: Manifest  # its videos

    def check_videos(self) -> None:
        """Raise StudyError unless every video that somebody may see is there as it was made."""
        clips, pairs = all_videos(self.design)
        for name in [each.name for each in (*clips, *pairs)]:
            video = self.manifest.videos.get(name)
            path = self.folder / (video.file if video else f"{VIDEOS}/{name}.mp4")
            if video is None or not path.is_file() or file_sha256(path, StudyError) != video.sha256:
                raise StudyError.about(
                    path,
                    found="missing, or another file than was made",
                    allowed="every video of the study",
                    remedy="`elocute study new` makes it",
                )


def read_manifest(folder: Path) -> Manifest:
    """Read the manifest in a study's folder.

    Raises StudyError where it is missing or something else.
    """
    path = folder / NAME
    record = read_record(path, MANIFEST_FILE)
    try:
        if record["format"] != FORMAT or record["version"] != 1:
            raise ValueError("another format or version")
        sounds = tuple(_sound(each) for each in record["sounds"])
        videos = [_video(each) for each in record["videos"]]
        notes = tuple(str(each) for each in record["notes"])
        return Manifest(str(record["design_sha256"]), sounds, {v.name: v for v in videos}, notes)
    except (KeyError, TypeError, ValueError) as problem:
        raise MANIFEST_FILE.unusable(path, f"no such manifest ({problem})") from None


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
    """Open a folder that `elocute study new` made.

    Raises StudyError for a folder that is none, or whose study.toml was changed since its videos
    were made.
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
    """A study by its folder or file, and the SHA-256 of what its videos were made of.

    That is "" where none are made yet. Beside a manifest the sounds are those of the manifest; else
    patterns of sounds begin at `data`, by default the file's folder, and with `elsewhere` one that
    nothing fits stays a pattern. Raises StudyError for files that cannot be read, and a pattern
    that nothing fits.
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
