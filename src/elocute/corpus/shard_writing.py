"""Writing shards clip by clip, in memory for one shard."""

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
    """Takes clips and writes a shard for every so many; `shard_writer` makes one."""

    def __init__(self, folder: Path, components: int, rows: int) -> None:
        self.folder, self.components, self.rows = folder, components, rows
        self.entries: list[ShardEntry] = []
        self._waiting: list[WordClip] = []
        self._names: set[str] = set()
        self._parts: dict[str, str] = {}

    def add(self, clip: WordClip) -> None:
        """Append a clip. Raises CorpusError where its name was there, or its speaker elsewhere."""
        take_apart(clip.clip, clip.speaker, clip.split, self._names, self._parts)
        self._waiting.append(clip)
        if len(self._waiting) >= self.rows:
            self.flush()

    def flush(self) -> None:
        if self._waiting:
            path = self.folder / f"words-{len(self.entries):05}.parquet"
            self.entries.append(write_shard(path, self._waiting, self.components))
            self._waiting.clear()


@contextlib.contextmanager
def shard_writer(
    folder: str | Path, basis: Motion, *, note: str = "", rows: int = ROWS
) -> Iterator[ShardWriter]:
    """A ShardWriter whose folder appears under its name only when the block ends well.

    basis  a Motion on the head whose shapes the parameters weigh (`learn_blendshapes`, `sweep`)
    rows   clips in a shard

    Raises OutputError for a folder that is there, CorpusError where nothing was added.
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
    """Name the shards that lie in a folder, and the basis beside them. Raises CorpusError."""
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


def take_apart(clip: str, speaker: str, split: str, names: set[str], parts: dict[str, str]) -> None:
    """Note a clip and its speaker's split; CorpusError where either contradicts what was noted."""
    if clip in names:
        raise CorpusError.about(f"clip {clip}", found="there twice", allowed="each clip once")
    names.add(clip)
    if parts.setdefault(speaker, split) != split:
        raise CorpusError.about(
            f"speaker {speaker}",
            found=f"in {parts[speaker]} and in {split}",
            allowed="each speaker in one split",
        )
