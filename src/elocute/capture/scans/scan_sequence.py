"""A folder of scans: numbered .ply or .obj files, and capture.json that says what they are.

capture.json         {"format": "elocute-scans", "version": 1, "fps": 60, "unit": "mm", …}
00000.ply, …         one frame each; the number is the last run of digits in the name
00000.json           its 68 landmarks, where they are known, here or in landmarks/
sound.wav            as named by "sound"
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from elocute.corpus.clip import check_name
from elocute.errors import CaptureError, CorpusError
from elocute.files.json_records import read_record, write_record
from elocute.files.reading import FileKind
from elocute.motion.motion import FPS_MAX
from elocute.registration.landmarks import (
    BESIDE_SUFFIXES,
    GOOD_MIN,
    LANDMARK_FILE,
    Landmarks,
    no_landmarks,
    read_landmarks,
)
from elocute.registration.scan import Scan
from elocute.registration.scan_file import SUFFIXES, read_scan, unit_m

MANIFEST = "capture.json"
FORMAT, VERSION = "elocute-scans", 1
MANIFEST_MAX_BYTES = 1_000_000
NUMBER_MAX = 1_000_000
TEXT_MAX, NAME_MAX = 10_000, 200
SAMPLE = 65_536


@dataclass(frozen=True)
class SequenceMetadata:
    """What capture.json says.

    Attributes
    ----------
    fps
        Frames per second; frame number n is at (n - first number) / fps seconds.
    unit
        Of the coordinates: m, mm, cm, dm or inch.
    subject
        Who is scanned; all sequences of a subject share one neutral face.
    sentence
        An identifier of what is said.
    text
        The words, or "".
    sound
        File name in the folder, or "".
    neutral
        Number of a frame with a resting face, or None for the first.

    Raises
    ------
    CaptureError
        For a value that is not allowed.
    """

    fps: float = 60.0
    unit: str = "m"
    subject: str = "subject"
    sentence: str = "sequence"
    text: str = ""
    sound: str = ""
    neutral: int | None = None

    def __post_init__(self) -> None:
        if not 0 < self.fps <= FPS_MAX:
            raise CaptureError(f"fps: found {self.fps}; allowed: above 0, at most {FPS_MAX:g}")
        unit_m(self.unit)
        try:
            check_name(self.subject, "subject")
            check_name(self.sentence, "sentence")
        except CorpusError as error:
            raise CaptureError(str(error)) from error
        if len(self.sound) > NAME_MAX:
            raise CaptureError(
                f"sound: found a name of {len(self.sound)} characters; allowed: {NAME_MAX}"
            )
        if self.sound and (Path(self.sound).name != self.sound or self.sound.startswith(".")):
            raise CaptureError(
                f"sound: found {self.sound[:60]!r}; allowed: a file name in the folder"
            )


@dataclass(frozen=True)
class ScanSequence:
    """Scans in the order of their numbers, read when asked for.

    Attributes
    ----------
    folder
        Where they are.
    metadata
        What capture.json says.
    numbers
        (frame,) ascending, with gaps possible: `missing` names them.
    files
        (frame,) their paths.
    """

    folder: Path
    metadata: SequenceMetadata
    numbers: tuple[int, ...]
    files: tuple[Path, ...]

    @property
    def name(self) -> str:
        return f"{self.metadata.subject}.{self.metadata.sentence}"

    @property
    def missing(self) -> tuple[int, ...]:
        """Numbers between the first and the last for which there is no file."""
        there = set(self.numbers)
        return tuple(n for n in range(self.numbers[0], self.numbers[-1] + 1) if n not in there)

    @property
    def frame_count(self) -> int:
        """Frames of the motion; gaps count."""
        return self.numbers[-1] - self.numbers[0] + 1

    @property
    def neutral(self) -> int:
        """Number of the frame that shows the resting face."""
        return self.numbers[0] if self.metadata.neutral is None else self.metadata.neutral

    @property
    def sound_path(self) -> Path | None:
        return self.folder / self.metadata.sound if self.metadata.sound else None

    def file(self, number: int) -> Path:
        """The path of a scan. Raises CaptureError for a number that is not there."""
        if number not in self.numbers:
            raise CaptureError.about(
                self.folder,
                found=f"no frame {number}",
                allowed=f"{self.numbers[0]} to {self.numbers[-1]} but for the missing",
            )
        return self.files[self.numbers.index(number)]

    def digest(self, number: int) -> str:
        """Another one where the frame's landmarks were edited, or its scan replaced.

        Of a scan its size and three samples are taken, since all of it would be hours of reading.
        """
        made_of, scan = hashlib.sha256(), self.file(number)
        for path in filter(None, (scan, self.landmark_file(number))):
            # What is wrong with a file is said where it is read.
            with contextlib.suppress(OSError), path.open("rb") as file:
                size = file.seek(0, os.SEEK_END)
                made_of.update(f"{path.suffix} {size} ".encode())
                starts = (0, size // 2, size - SAMPLE) if path == scan else (0,)
                for start in starts:
                    file.seek(max(0, start))
                    made_of.update(file.read(SAMPLE if path == scan else LANDMARK_FILE.max_bytes))
        return made_of.hexdigest()

    def scan(self, number: int) -> Scan:
        """The scan as it is in the file. Raises CaptureError."""
        return read_scan(self.file(number), self.metadata.unit)

    def landmark_file(self, number: int) -> Path | None:
        """The file of the frame's landmarks, if there is one."""
        stem = self.file(number).stem
        for folder in (self.folder, self.folder / "landmarks"):
            for suffix in BESIDE_SUFFIXES:
                if (folder / (stem + suffix)).is_file():
                    return folder / (stem + suffix)
        return None

    def landmarks(self, number: int) -> Landmarks:
        """The landmarks of a scan; unknown ones where there is no file of them.

        Raises CaptureError for a file that cannot be read and for one with too few good points:
        such a scan is flagged and its frame interpolated, never silently used.
        """
        path = self.landmark_file(number)
        if path is None:
            return no_landmarks()
        landmarks = read_landmarks(path, unit_m(self.metadata.unit))
        if not landmarks.enough:
            raise CaptureError.about(
                path,
                found=f"{int(landmarks.good.sum())} good landmarks",
                allowed=f"{GOOD_MIN} or more",
            )
        return landmarks


def open_sequence(
    folder: str | Path, *, fps: float | None = None, unit: str | None = None
) -> ScanSequence:
    """The scans in a folder.

    Parameters
    ----------
    folder
        Of numbered .ply or .obj files. Without capture.json its name is the sentence, and fps must
        be given.
    fps, unit
        Override what capture.json says.

    Raises
    ------
    CaptureError
        For a folder without scans, two files of one number, and metadata that is wrong.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise CaptureError.about(folder, found="no such folder", allowed="a folder of scans")
    metadata = _read_metadata(folder, fps)
    changed: dict[str, Any] = {"fps": fps, "unit": unit}
    metadata = replace(metadata, **{k: v for k, v in changed.items() if v is not None})
    numbered = _numbered(folder)
    sequence = ScanSequence(folder, metadata, tuple(numbered), tuple(numbered.values()))
    if sequence.neutral not in numbered:
        raise CaptureError.about(
            folder / MANIFEST,
            found=f"neutral {sequence.neutral}, no such frame",
            allowed=f"a number from {sequence.numbers[0]} to {sequence.numbers[-1]}",
        )
    if sequence.sound_path is not None and not sequence.sound_path.is_file():
        raise CaptureError.about(sequence.sound_path, found="no such file", allowed="a sound")
    return sequence


def find_sequences(folder: str | Path) -> list[Path]:
    """The folder itself where it holds scans, else those directly in it. Raises CaptureError."""
    folder = Path(folder)
    if not folder.is_dir():
        raise CaptureError.about(folder, found="no such folder", allowed="a folder of scans")
    if (folder / MANIFEST).is_file() or _scan_files(folder):
        return [folder]
    folders = sorted(
        inner
        for inner in folder.iterdir()
        if inner.is_dir() and ((inner / MANIFEST).is_file() or _scan_files(inner))
    )
    if not folders:
        raise CaptureError.about(
            folder, found="no scans", allowed=f"numbered {' or '.join(SUFFIXES)} files"
        )
    return folders


def write_metadata(folder: Path, metadata: SequenceMetadata) -> None:
    """Write capture.json into a folder. Raises OutputError."""
    record = {"format": FORMAT, "version": VERSION}
    record |= {field.name: getattr(metadata, field.name) for field in fields(metadata)}
    write_record(folder / MANIFEST, record, indent=1)


def _read_metadata(folder: Path, fps: float | None) -> SequenceMetadata:
    path = folder / MANIFEST
    if not path.is_file():
        if fps is None:
            raise CaptureError.about(
                folder,
                found=f"no {MANIFEST}",
                allowed='one with "fps" and "unit"',
                remedy="or say `fps` and `unit`",
            )
        plain = re.sub(r"[^A-Za-z0-9_.-]", "-", folder.resolve().name).lstrip("_.-")
        return SequenceMetadata(fps=fps, sentence=plain or "sequence")
    known = {field.name: type(field.default) for field in fields(SequenceMetadata)}
    allowed_facts = f'{{"format": "{FORMAT}", "version": {VERSION}, "fps": 60, "unit": "mm", …}}'
    record = read_record(path, FileKind(allowed_facts, MANIFEST_MAX_BYTES, CaptureError))
    try:
        if record["format"] != FORMAT or record["version"] != VERSION:
            raise ValueError("another format or version")
        values = {name: record[name] for name in known if name in record}
        for name, value in values.items():
            allowed = (int, type(None)) if name == "neutral" else known[name]
            if known[name] is float:
                allowed = (int, float)
            if not isinstance(value, allowed) or isinstance(value, bool):
                raise ValueError(f"{name} is {str(value)[:60]!r}")
            if isinstance(value, str) and len(value) > TEXT_MAX:
                raise ValueError(f"{name} of {len(value)} characters")
        return SequenceMetadata(**values)
    except CaptureError as error:
        raise CaptureError(f"{path}: {error}") from error
    except (ValueError, KeyError, TypeError) as error:
        raise CaptureError.about(
            path, found=f"cannot be used ({str(error)[:120]})", allowed=allowed_facts
        ) from error


def _scan_files(folder: Path) -> list[Path]:
    return sorted(
        path
        for path in folder.iterdir()
        if path.suffix.lower() in SUFFIXES and path.is_file() and not path.name.startswith(".")
    )


def _numbered(folder: Path) -> dict[int, Path]:
    """Number to file, by number. Raises CaptureError for none and for two of one number."""
    numbered: dict[int, Path] = {}
    for path in _scan_files(folder):
        digits = re.findall(r"\d+", path.stem)
        if not digits or len(digits[-1]) > 9:
            raise CaptureError.about(
                path, found="no number in the name", allowed="frame numbers: 00000.ply, 00001.ply"
            )
        number = int(digits[-1])
        if number in numbered:
            raise CaptureError.about(path, found=f"number {number}, as {numbered[number].name}")
        numbered[number] = path
    if not numbered:
        raise CaptureError.about(
            folder, found="no scans", allowed=f"numbered {' or '.join(SUFFIXES)} files"
        )
    if max(numbered) - min(numbered) >= NUMBER_MAX:
        raise CaptureError.about(
            folder,
            found=f"numbers from {min(numbered)} to {max(numbered)}",
            allowed=f"a range below {NUMBER_MAX}",
        )
    return dict(sorted(numbered.items()))
