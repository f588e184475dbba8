"""One shard: a Parquet file of WordClips, and the table that describes it."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from elocute.corpus.word_clip import WordClip
from elocute.errors import CorpusError, needs_extra
from elocute.files.atomic import write_atomically

FILE_MAX_BYTES = 4_000_000_000
BATCH_ROWS = 64  # rows in memory at once while reading
TEXTS = ("clip", "word", "speaker", "source", "split", "audio")
NUMBERS = ("start_s", "end_s", "fps", "confidence")


@dataclass(frozen=True)
class ShardEntry:
    """A shard as the manifest lists it: file name, rows, SHA-256 of the file."""

    name: str
    rows: int
    sha256: str


def parquet() -> Any:
    """pyarrow.parquet. Raises MachineError with what to install."""
    with needs_extra("reading shards", "wild"):
        import pyarrow.parquet
    return pyarrow.parquet


def schema(components: int) -> Any:
    """The columns of docs/design.md: `parameters` is a list of `components` floats per frame."""
    parquet()
    import pyarrow as pa

    row = pa.list_(pa.float32(), components)
    return pa.schema(
        [
            *((name, pa.string()) for name in TEXTS),
            ("start_s", pa.float64()), ("end_s", pa.float64()), ("fps", pa.float64()),
            ("frames", pa.int32()), ("parameters", pa.list_(row)), ("confidence", pa.float32()),
        ]
    )  # fmt: skip


def write_shard(path: str | Path, clips: Sequence[WordClip], components: int) -> ShardEntry:
    """Write one shard, whole or not at all. Raises CorpusError, OutputError, MachineError.

    Workers that write a shard each give their entries to `shards.write_manifest` at the end.
    """
    path = Path(path)
    if not clips:
        raise CorpusError.about(path, found="no clip", allowed="one or more")
    for clip in clips:
        if clip.parameters.shape[1] != components:
            raise CorpusError.about(
                f"clip {clip.clip}", found=f"{clip.parameters.shape[1]} parameters a frame",
                allowed=f"{components}, the shapes of the basis",
            )  # fmt: skip
    with write_atomically(path) as draft:
        parquet().write_table(_table(clips, components), draft, compression="zstd")
        digest = sha256_of(draft)
    return ShardEntry(path.name, len(clips), digest)


def _table(clips: Sequence[WordClip], components: int) -> Any:
    import pyarrow as pa

    flat = pa.array(np.concatenate([clip.parameters.ravel() for clip in clips]))
    ends = np.cumsum([0, *(len(clip) for clip in clips)]).astype(np.int32)
    columns: list[Any] = [pa.array([getattr(clip, name) for clip in clips]) for name in TEXTS]
    columns += [
        pa.array([float(getattr(clip, name)) for clip in clips])
        for name in ("start_s", "end_s", "fps")
    ]
    columns += [
        pa.array([len(clip) for clip in clips], pa.int32()),
        pa.ListArray.from_arrays(ends, pa.FixedSizeListArray.from_arrays(flat, components)),
        pa.array([clip.confidence for clip in clips], pa.float32()),
    ]
    return pa.Table.from_arrays(columns, schema=schema(components))


def sha256_of(path: Path) -> str:
    """Of a file, read in blocks."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def fault(path: Path, entry: ShardEntry, components: int) -> str | None:
    """Why a shard cannot be used, or None."""
    import pyarrow as pa

    pq = parquet()
    if not path.is_file():
        return "no such file"
    if path.stat().st_size > FILE_MAX_BYTES:
        return "more than 4 GB"
    if sha256_of(path) != entry.sha256:
        return "another checksum than the manifest's: truncated or altered"
    try:
        with pq.ParquetFile(path) as file:
            rows, found = file.metadata.num_rows, file.schema_arrow
    except (pa.ArrowException, OSError, ValueError) as error:
        return f"no Parquet file ({' '.join(str(error).split())[:120]})"
    if rows != entry.rows:
        return f"{rows} rows instead of {entry.rows}"
    return None if found.equals(schema(components)) else "other columns than a shard has"


def read_columns(path: Path, names: Sequence[str]) -> list[dict[str, str]]:
    """Some text columns of all rows."""
    return parquet().read_table(path, columns=list(names)).to_pylist()


def read_clips(path: Path, components: int, split: str | None = None) -> Iterator[WordClip]:
    """Rows one after another, few in memory. Raises CorpusError naming shard and row."""
    row = 0
    with parquet().ParquetFile(path) as file:
        for batch in file.iter_batches(BATCH_ROWS):
            for index in range(batch.num_rows):
                row += 1
                if split in (None, batch["split"][index].as_py()):
                    yield _clip(path, batch, index, row, components)


def _clip(path: Path, batch: Any, index: int, row: int, components: int) -> WordClip:
    try:
        scalar = batch["parameters"][index].values
        # `flatten` leaves out rows that are null, so a hole shows as a missing frame.
        values = scalar.flatten().to_numpy(zero_copy_only=False).reshape(-1, components)
        if len(values) != batch["frames"][index].as_py():
            raise ValueError("frames and parameters differ in number")
        fields = {name: batch[name][index].as_py() for name in (*TEXTS, *NUMBERS)}
        return WordClip(**fields, parameters=values)
    except (CorpusError, ValueError, TypeError, AttributeError) as error:
        raise CorpusError.about(f"{path}, row {row}", found=f"cannot be used ({error})") from error
