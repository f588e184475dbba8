"""Writing shards clip by clip, with one shard in memory."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from elocute.corpus.shard_file import ShardEntry, write_shard
from elocute.corpus.word_clip import WordClip
from elocute.errors import CorpusError
from elocute.files.atomic import write_atomically, write_folder_atomically
from elocute.motion.motion import Motion
from elocute.motion.store import save_motion

FORMAT, VERSION = "elocute-shards", 1
MANIFEST, BASIS = "manifest.json", "basis.npz"
ROWS = 1000


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
    with write_atomically(folder / MANIFEST) as draft:
        draft.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


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
