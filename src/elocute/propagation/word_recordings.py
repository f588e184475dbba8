"""Recordings of single words by many speakers, as folders hold them.

    lipread_mp4/WORD/{train,val,test}/WORD_00001.mp4   LRW, with a .txt that says how long the word
                                                        in the middle of the picture is
    WORD/{train,val,test}/SPEAKER__TAKE.wav            split by the folder
    WORD/SPEAKER__TAKE.wav                             split by a hash of the speaker

LRW does not say who speaks: each of its clips counts as a speaker of its own. Its sound is a little
longer than its picture, 29 frames at 25 a second, with which it begins.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from elocute.corpus.clip import NAME_PATTERN
from elocute.errors import CorpusError
from elocute.files.media import open_media
from elocute.files.reading import FileKind, read_text

SUFFIXES = {".wav", ".flac", ".ogg", ".opus", ".mp3", ".m4a", ".mp4"}
FOLDERS = {"train": "train", "val": "validation", "validation": "validation", "test": "test"}
LRW_NAME = re.compile(r"(.+)_\d{5}")
DURATION = re.compile(
    r"^Duration:[ \t]*([0-9]{1,9}(?:\.[0-9]{1,30})?)[ \t]*seconds?[ \t\r]*$", re.MULTILINE
)
LRW_TEXT = FileKind("a text as in LRW", 100_000, CorpusError)
LRW_S, LRW_LONGER_S = 29 / 25, 0.1
"""How long a picture of LRW's lasts, and how much longer its sound may."""
VALIDATION_SHARE, TEST_SHARE = 0.1, 0.1


@dataclass(frozen=True)
class WordRecording:
    """One recording of one word; paths are relative to the folder of recordings.

    timing: a .txt as in LRW, or "" where the word fills the whole sound. made_of: another one where
    the sound has another size or the .txt says something else.
    """

    clip: str
    word: str
    speaker: str
    split: str
    audio: str
    timing: str = ""
    made_of: str = ""


@dataclass(frozen=True)
class WordRecordings:
    """A folder of words, of which `of` lists one at a time to save memory.

    Parameters
    ----------
    folder : Path
        The folder.
    words : dict of str to str
        Spelling in lower case to the name of its folder.
    """

    folder: Path
    words: dict[str, str] = field(default_factory=dict)

    def of(self, word: str) -> tuple[list[WordRecording], list[tuple[str, str]]]:
        """Recordings of a word, sorted by name; and files that are left out, with the reason."""
        recordings: list[WordRecording] = []
        skipped: list[tuple[str, str]] = []
        for path, part in _files(self.folder / self.words[word]):
            name = path.relative_to(self.folder).as_posix()
            clip = f"{word}.{path.stem}".replace("'", "-")
            if not NAME_PATTERN.fullmatch(clip):
                skipped.append(
                    (
                        name,
                        "name that is not 1 to 120 of letters, digits, _ . -",
                    )
                )
                continue
            if (
                recordings
                and recordings[-1].clip == clip
                and _folder(recordings[-1].audio) == _folder(name)
            ):
                skipped.append((name, "same name as another file, other suffix"))
                continue
            speaker = _speaker(path.stem.replace("'", "-"))
            timing = path.with_suffix(".txt")
            recordings.append(
                WordRecording(
                    clip=clip,
                    word=word,
                    speaker=speaker,
                    split=part or _split_of(speaker),
                    audio=name,
                    timing=timing.relative_to(self.folder).as_posix() if timing.is_file() else "",
                    made_of=_made_of(path, timing),
                )
            )
        repeated = _repeated(recordings)
        if repeated:
            raise CorpusError.about(
                self.folder / self.words[word],
                found=f"{repeated} in two splits",
                allowed="each recording once",
            )
        return recordings, skipped


def find_recordings(folder: str | Path) -> WordRecordings:
    """The words of which a folder holds recordings.

    Parameters
    ----------
    folder
        WORD/*.wav, WORD/{train,val,test}/*.wav, or LRW as it is distributed.

    Returns
    -------
    WordRecordings

    Raises
    ------
    CorpusError
        Where there is no such folder or no word in it, a word's name cannot be a file's, or a
        speaker is in two splits.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise CorpusError.about(folder, found="no folder", allowed="a folder WORD/*.wav, or LRW")
    inner = folder / "lipread_mp4"
    top = inner if inner.is_dir() else folder
    words: dict[str, str] = {}
    for entry in sorted(os.scandir(top), key=lambda entry: entry.name):
        if (
            not entry.is_dir()
            or entry.name.startswith(".")
            or next(_files(Path(entry)), None) is None
        ):
            continue
        word = entry.name.casefold()
        if not NAME_PATTERN.fullmatch(word.replace("'", "_")) or word in words:
            raise CorpusError.about(
                entry.path,
                found="a folder that cannot be a word",
                allowed="letters, digits, ' _ . -, each word once",
            )
        words[word] = Path(entry).relative_to(folder).as_posix()
    if not words:
        raise CorpusError.about(
            folder, found="no recordings of words", allowed="WORD/*.wav, WORD/train/*.wav or LRW"
        )
    recordings = WordRecordings(folder, words)
    _check_apart(recordings)
    return recordings


def word_span(recordings: Path, recording: WordRecording, duration_s: float) -> tuple[float, float]:
    """Start and end in s of the word in its sound. Raises CorpusError for a .txt without them."""
    if not recording.timing:
        return 0.0, duration_s
    path = recordings / recording.timing
    text = read_text(path, LRW_TEXT)
    match = DURATION.search(text)
    seconds = float(match.group(1)) if match else 0.0
    if not 0 < seconds <= duration_s + 0.1:
        raise CorpusError.about(
            path,
            found=f"a word of {seconds:g} s" if match else "no line `Duration`",
            allowed=f"Duration: above 0, up to {duration_s:.2f} seconds",
        )
    middle = min(_picture_s(recordings / recording.audio, duration_s), duration_s) / 2
    return max(0.0, middle - seconds / 2), min(duration_s, middle + seconds / 2)


def _picture_s(path: Path, duration_s: float) -> float:
    """How long the picture lasts, s; as long as the sound where there is none.

    The sound alone, taken out of a clip of LRW's, had a picture.
    """
    if path.suffix.lower() not in (".mp4", ".m4a"):
        taken_out = LRW_NAME.fullmatch(path.stem) and LRW_S < duration_s < LRW_S + LRW_LONGER_S
        return LRW_S if taken_out else duration_s
    try:
        with open_media(path) as media:
            for stream in media.streams.video:
                if stream.frames and stream.average_rate:
                    return float(stream.frames / stream.average_rate)
    except (OSError, ValueError):
        pass  # what is wrong with it is said where its sound is read
    return duration_s


def _files(folder: Path) -> Iterator[tuple[Path, str]]:
    """Sounds of a word with their split ("" where no folder names it), sorted by name."""
    names = sorted(entry.name for entry in os.scandir(folder) if not entry.name.startswith("."))
    for name in names:
        path = folder / name
        if name in FOLDERS and path.is_dir():
            for inner in sorted(entry.name for entry in os.scandir(path)):
                if Path(inner).suffix.lower() in SUFFIXES and not inner.startswith("."):
                    yield path / inner, FOLDERS[name]
        elif path.suffix.lower() in SUFFIXES:
            yield path, ""


def _made_of(sound: Path, timing: Path) -> str:
    with contextlib.suppress(OSError):  # what is wrong with a file is said where it is read
        says = 0
        if timing.is_file():
            with timing.open("rb") as file:
                says = zlib.crc32(file.read(LRW_TEXT.max_bytes))
        return f"{sound.stat().st_size} {says:08x}"
    return ""


def _folder(name: str) -> str:
    return name.rpartition("/")[0]


def _speaker(stem: str) -> str:
    return stem.split("__")[0] or stem


def _split_of(speaker: str) -> str:
    share = int(hashlib.sha256(speaker.encode()).hexdigest()[:8], 16) / 0xFFFFFFFF
    if share < TEST_SHARE:
        return "test"
    return "validation" if share < TEST_SHARE + VALIDATION_SHARE else "train"


def _repeated(found: list[WordRecording]) -> str:
    clips: set[str] = set()
    for recording in found:
        if recording.clip in clips:
            return recording.clip
        clips.add(recording.clip)
    return ""


def _check_apart(recordings: WordRecordings) -> None:
    """Refuse a speaker in two splits; LRW's anonymous clips need not be remembered."""
    parts: dict[str, str] = {}
    for word in recordings.words:
        for recording in recordings.of(word)[0]:
            if LRW_NAME.fullmatch(recording.speaker):
                continue
            if parts.setdefault(recording.speaker, recording.split) != recording.split:
                raise CorpusError.about(
                    recordings.folder,
                    found=f"speaker {recording.speaker} in {parts[recording.speaker]} and in "
                    f"{recording.split} ({recording.audio})",
                    allowed="each speaker in one split",
                )
