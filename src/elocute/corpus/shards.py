"""Shards: words of many speakers with motion parameters, as Parquet files in a folder.

    manifest.json   the shards with rows and SHA-256, how many parameters, a note; no paths
    basis.npz       what the parameters weigh: a Motion that shows each shape in turn
    NAME.parquet    rows as `WordClip` describes them

Any tool that reads Parquet reads them: DuckDB, Ray Data, pandas. Sounds stay where they are, in a
folder that the reader names.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

from elocute.audio.waveform import Waveform
from elocute.corpus.shard_file import (
    ShardEntry,
    pyarrow_parquet,
    read_clips,
    read_text_columns,
    shard_fault,
    write_shard,
)
from elocute.corpus.word_clip import COMPONENTS_MAX, SPLITS, WordClip, is_inside
from elocute.errors import CorpusError
from elocute.files.atomic import write_folder_atomically
from elocute.files.json_records import read_record, write_record
from elocute.files.reading import FileKind, is_file
from elocute.motion.motion import Motion
from elocute.motion.store import load_motion, save_motion
from elocute.one_line_repr import one_line

FORMAT, VERSION = "elocute-shards", 1
MANIFEST, BASIS = "manifest.json", "basis.npz"
ROWS = 1000
MANIFEST_MAX_BYTES = 64_000_000
SHARD_NAME_PATTERN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,119}\.parquet")
SHA256 = re.compile(r"[0-9a-f]{64}")
SOUNDS_KEPT = 4  # recordings in memory: words often follow one another in one file


@dataclass(frozen=True, eq=False)
class Shards:
    """The clips of a folder of shards, read when they are asked for; `open_shards` makes one.

    Attributes
    ----------
    folder : Path
        Of the shards.
    sound_root : Path
        Folder that the clips' sounds lie below.
    components : int
        Parameters of a frame.
    entries : tuple of ShardEntry
        Shards that can be used.
    broken : tuple of (str, str)
        Names of those that cannot, with the reason.
    note : str
        Origin and licence, in words.
    """

    folder: Path
    sound_root: Path
    components: int
    entries: tuple[ShardEntry, ...]
    broken: tuple[tuple[str, str], ...]
    note: str

    __repr__ = one_line

    def clips(self, split: str | None = None) -> Iterator[WordClip]:
        """Read clips, with few in memory.

        Parameters
        ----------
        split : str, optional
            "train", "validation" or "test"; all by default.

        Yields
        ------
        WordClip
            In the order of the shards.

        Raises
        ------
        CorpusError
            For an unknown split, or naming a row that cannot be used.
        """
        if split not in (None, *SPLITS):
            raise CorpusError.about(f"split {split!r}", found="unknown", allowed=", ".join(SPLITS))
        for entry in self.entries:
            yield from read_clips(self.folder / entry.name, self.components, split)

    def __len__(self) -> int:
        return sum(entry.rows for entry in self.entries)

    @cached_property
    def basis(self) -> Motion:
        """On the head whose shapes the parameters weigh. Raises MotionError or CorpusError."""
        motion = load_motion(self.folder / BASIS)
        if len(motion.names) != self.components:
            raise CorpusError.about(
                self.folder / BASIS,
                found=f"{len(motion.names)} shapes",
                allowed=f"{self.components}, as manifest.json says",
            )
        return motion

    def sound(self, clip: WordClip, margin_s: float = 0.0) -> Waveform:
        """Read the sound of a clip, from start_s to end_s.

        Parameters
        ----------
        clip : WordClip
            A clip of these shards.
        margin_s : float
            How much more is read at both ends, s.

        Returns
        -------
        Waveform
            With silence where the file does not reach.

        Raises
        ------
        AudioError
            For a file that is missing or damaged.
        CorpusError
            For a file outside the folder of sounds, or a clip that starts behind its end.
        """
        whole = _recording(*self._confined(clip))
        rate = whole.sample_rate
        if clip.start_s >= whole.duration_s:
            raise CorpusError.about(
                f"clip {clip.clip}",
                found=f"a start at {clip.start_s:.2f} s",
                allowed=f"below {whole.duration_s:.2f} s, the length of {clip.audio}",
            )
        first = round((clip.start_s - margin_s) * rate)
        last = max(first + 2, round((min(clip.end_s, whole.duration_s) + margin_s) * rate))
        part = whole.samples[max(first, 0) : last]
        padded = np.pad(part, (max(-first, 0), max(last - len(whole.samples), 0)))
        return Waveform(padded, rate)

    def _confined(self, clip: WordClip) -> tuple[Path, int]:
        """The clip's file below the folder of sounds, and when it changed."""
        root = self.sound_root.resolve()
        path = (root / clip.audio).resolve()
        if not is_inside(clip.audio) or not path.is_relative_to(root):
            raise CorpusError.about(
                f"clip {clip.clip}", found=f"sound {clip.audio[:80]!r} outside the folder of sounds"
            )
        return path, path.stat().st_mtime_ns if path.is_file() else 0


@lru_cache(SOUNDS_KEPT)
def _recording(path: Path, _changed: int) -> Waveform:
    """A whole recording, kept for the next clips of it."""
    from elocute.audio.read import read_audio

    return read_audio(path)


def open_shards(folder: str | Path, sound_root: str | Path) -> Shards:
    """Read the manifest and check every shard against it; clips stay on disk.

    A shard that is missing, truncated or altered is named in `broken` and left out.

    Parameters
    ----------
    folder : str or Path
        The folder of the shards.
    sound_root : str or Path
        The folder that their sounds lie below.

    Returns
    -------
    Shards
        The shards that can be used.

    Raises
    ------
    CorpusError
        Where none is left, a speaker is in two splits, or a clip occurs twice.
    MachineError
        Without pyarrow.
    """
    folder, sound_root = Path(folder), Path(sound_root)
    pyarrow_parquet()
    components, entries, note = _read_manifest(folder)
    if not sound_root.is_dir():
        raise CorpusError.about(sound_root, found="no folder", allowed="the folder of the sounds")
    faults = {entry: shard_fault(folder / entry.name, entry, components) for entry in entries}
    usable = tuple(entry for entry, why in faults.items() if why is None)
    broken = tuple((entry.name, why) for entry, why in faults.items() if why is not None)
    if not usable:
        name, why = broken[0]
        raise CorpusError.about(
            folder, found=f"no shard that can be used; {name}: {why}", allowed="one or more"
        )
    _check_splits(folder, usable)
    return Shards(folder, sound_root, components, usable, broken, note)


def _check_splits(folder: Path, entries: Sequence[ShardEntry]) -> None:
    """Raise CorpusError for a speaker in two splits, or a clip that is there twice."""
    splits = DisjointSplits()
    for entry in entries:
        for row in read_text_columns(folder / entry.name, ("clip", "speaker", "split")):
            try:
                splits.add(row["clip"], row["speaker"], row["split"])
            except CorpusError as error:
                raise CorpusError(f"{folder / entry.name}: {error}") from error


def _read_manifest(folder: Path) -> tuple[int, list[ShardEntry], str]:
    """Number of parameters, shards and note of a manifest, checked."""
    path = folder / MANIFEST
    if not is_file(path):
        raise CorpusError.about(
            folder,
            found="no manifest.json in it",
            allowed="a folder of shards",
            remedy="make one: elocute propagate",
        )
    allowed = f"a manifest of shards, format {FORMAT}"
    record = read_record(path, FileKind(allowed, MANIFEST_MAX_BYTES, CorpusError))
    try:
        if record["format"] != FORMAT or record["version"] != VERSION:
            raise ValueError("another format or version")
        entries = [
            ShardEntry(_shard_name(item["name"]), _count(item["rows"]), _digest(item["sha256"]))
            for item in record["shards"]
        ]
        components, note = _count(record["components"]), record["note"]
        if not entries or len({entry.name for entry in entries}) != len(entries):
            raise ValueError("no shard, or a shard twice")
        if components > COMPONENTS_MAX or not isinstance(note, str):
            raise ValueError(f"more than {COMPONENTS_MAX} parameters, or a note that is no text")
        return components, entries, note
    except (ValueError, KeyError, TypeError) as error:
        raise CorpusError.about(
            path, found=f"no manifest of shards ({str(error)[:120]})", allowed=allowed
        ) from error


def _count(value: object) -> int:
    """A whole number above 0; raises ValueError for anything else."""
    if type(value) is not int or value < 1:
        raise ValueError("a number of rows or parameters that is none")
    return value


def _digest(value: object) -> str:
    """A SHA-256; raises ValueError for anything else."""
    if not isinstance(value, str) or not SHA256.fullmatch(value):
        raise ValueError("a checksum that is none")
    return value


def _shard_name(name: object) -> str:
    """The name of a shard's file; raises ValueError for anything else."""
    if not isinstance(name, str) or not SHARD_NAME_PATTERN.fullmatch(name):
        raise ValueError(f"shard {str(name)[:80]!r}")
    return name


class ShardWriter:
    """Takes clips and writes a shard for every so many; `shard_writer` makes one.

    Parameters
    ----------
    folder : Path
        An existing folder.
    components : int
        Parameters of a frame.
    rows : int
        Clips in a shard.

    Attributes
    ----------
    entries : list of ShardEntry
        Shards that were written.
    """

    def __init__(self, folder: Path, components: int, rows: int) -> None:
        self.folder, self.components, self.rows = folder, components, rows
        self.entries: list[ShardEntry] = []
        self._waiting: list[WordClip] = []
        self._splits = DisjointSplits()

    def add(self, clip: WordClip) -> None:
        """Append a clip.

        Parameters
        ----------
        clip : WordClip
            The clip.

        Raises
        ------
        CorpusError
            For a name that is there already, or a speaker that is in another split.
        """
        self._splits.add(clip.clip, clip.speaker, clip.split)
        self._waiting.append(clip)
        if len(self._waiting) >= self.rows:
            self.flush()

    def flush(self) -> None:
        """Write the clips that wait, however few."""
        if self._waiting:
            path = self.folder / f"words-{len(self.entries):05}.parquet"
            self.entries.append(write_shard(path, self._waiting, self.components))
            self._waiting.clear()


@contextlib.contextmanager
def shard_writer(
    folder: str | Path, basis: Motion, *, note: str = "", rows: int = ROWS
) -> Iterator[ShardWriter]:
    """Write shards whose folder appears under its name only when the block ends without error.

    Parameters
    ----------
    folder : str or Path
        A new folder.
    basis : Motion
        On the head whose shapes the parameters weigh, as from `learn_blendshapes`.
    note : str
        Origin and licence, in words.
    rows : int
        Clips in a shard.

    Yields
    ------
    ShardWriter
        Takes the clips.

    Raises
    ------
    OutputError
        For a folder that exists, or a place that cannot be written.
    CorpusError
        Where nothing was added.
    """
    if rows < 1:
        raise CorpusError.about("rows", found=str(rows), allowed="1 or more")
    with write_folder_atomically(folder) as draft:
        writer = ShardWriter(draft, len(basis.names), rows)
        yield writer
        writer.flush()
        write_manifest(draft, writer.entries, basis, note)


def write_manifest(
    folder: Path, entries: Sequence[ShardEntry], basis: Motion, note: str = ""
) -> None:
    """Write the manifest of shards that lie in a folder, and the basis beside it.

    The basis is a motion on the head whose shapes the parameters weigh; the note has origin and
    licence, in words. Raises CorpusError for no shard, OutputError where a file cannot be written.
    """
    if not entries:
        raise CorpusError.about(folder, found="no clip", allowed="one or more")
    save_motion(basis, folder / BASIS)
    record = {
        "format": FORMAT,
        "version": VERSION,
        "components": len(basis.names),
        "note": note,
        "shards": [asdict(entry) for entry in entries],
    }
    write_record(folder / MANIFEST, record, indent=1)


class DisjointSplits:
    """Clips that were seen and the split of each speaker, to find what is there twice."""

    def __init__(self) -> None:
        self._clips: set[str] = set()
        self._split_of: dict[str, str] = {}

    def add(self, clip: str, speaker: str, split: str) -> None:
        """Note a clip.

        Parameters
        ----------
        clip, speaker, split : str
            Their names.

        Raises
        ------
        CorpusError
            For a clip that was noted before, or a speaker that was noted in another split.
        """
        if clip in self._clips:
            raise CorpusError.about(f"clip {clip}", found="there twice", allowed="each clip once")
        self._clips.add(clip)
        known = self._split_of.setdefault(speaker, split)
        if known != split:
            raise CorpusError.about(
                f"speaker {speaker}",
                found=f"in {known} and in {split}",
                allowed="each speaker in one split",
            )
