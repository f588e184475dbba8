"""One shard: a Parquet file of WordClips, and the table that describes it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from elocute.corpus.word_clip import WordClip
from elocute.errors import CorpusError, needs_extra
from elocute.files.atomic import write_atomically
from elocute.files.parquet_size import unpacked_bytes
from elocute.files.reading import FileKind, bytes_text, file_sha256, open_regular
from elocute.files.unpacked_size import UNPACKED_TIMES, unpacked_limit

FILE_MAX_BYTES = 4_000_000_000
BATCH_ROWS = 64  # rows in memory at once while reading
TEXT_MAX = 10_000
TEXTS = ("clip", "word", "speaker", "source", "split", "audio")
NUMBERS = ("start_s", "end_s", "fps", "confidence")


@dataclass(frozen=True)
class ShardEntry:
    """A shard as the manifest lists it."""

    name: str  # file name
    rows: int  # number of clips
    sha256: str  # SHA-256 of the file, hexadecimal


def pyarrow_parquet() -> Any:
    """The module pyarrow.parquet, imported when needed; MachineError says what to install."""
    with needs_extra("reading shards", "wild"):
        import pyarrow.parquet
    return pyarrow.parquet


def shard_schema(components: int) -> Any:
    """The columns of a shard (a pyarrow.Schema), as docs/conventions.md lists them.

    `parameters` is a list of `components` floats for each frame.
    """
    pyarrow_parquet()
    import pyarrow as pa

    row = pa.list_(pa.float32(), components)
    return pa.schema(
        [
            *((name, pa.string()) for name in TEXTS),
            ("start_s", pa.float64()),
            ("end_s", pa.float64()),
            ("fps", pa.float64()),
            ("frames", pa.int32()),
            ("parameters", pa.list_(row)),
            ("confidence", pa.float32()),
        ]
    )


def write_shard(path: str | Path, clips: Sequence[WordClip], components: int) -> ShardEntry:
    """Write one shard of clips with `components` parameters a frame, whole or not at all.

    Workers that write a shard each give their entries to `shards.write_manifest` at the end.
    Raises CorpusError for no clip, or clips with another number of parameters, OutputError where
    the file cannot be written, MachineError without pyarrow.
    """
    path = Path(path)
    if not clips:
        raise CorpusError.about(path, found="no clip", allowed="one or more")
    for clip in clips:
        if clip.parameters.shape[1] != components:
            raise CorpusError.about(
                f"clip {clip.clip}",
                found=f"{clip.parameters.shape[1]} parameters a frame",
                allowed=f"{components}, the shapes of the basis",
            )
    with write_atomically(path) as draft:
        with draft.open("wb") as file:  # a path would have to be UTF-8
            pyarrow_parquet().write_table(_table(clips, components), file, compression="zstd")
        digest = file_sha256(draft, CorpusError)
    return ShardEntry(path.name, len(clips), digest)


def _table(clips: Sequence[WordClip], components: int) -> Any:
    """The rows as a pyarrow Table."""
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
    return pa.Table.from_arrays(columns, schema=shard_schema(components))


def shard_fault(path: Path, entry: ShardEntry, components: int) -> str | None:
    """Why a shard cannot be used by what the manifest says of it; None for a whole one."""
    if not path.is_file():
        return "no such file"
    if path.stat().st_size > FILE_MAX_BYTES:
        return "more than 4 GB"
    if file_sha256(path, CorpusError) != entry.sha256:
        return "another checksum than the manifest's: truncated or altered"
    try:
        with _opened(path) as file:
            rows, schema = file.metadata.num_rows, file.schema_arrow
    except CorpusError as error:
        return str(error)
    if rows != entry.rows:
        return f"{rows} rows instead of {entry.rows}"
    same = _plain_types(schema).equals(shard_schema(components))
    return None if same else "other columns than a shard has"


def read_text_columns(path: Path, names: Sequence[str]) -> Iterator[dict[str, str]]:
    """Read some of the columns `TEXTS` row by row, with few rows in memory.

    Raises CorpusError, naming the row that cannot be used.
    """
    row = 0
    for batch in _batches(path, names):
        for index in range(batch.num_rows):
            row += 1
            yield {name: _text(path, row, batch[name][index]) for name in names}


def read_clips(path: Path, components: int, split: str | None = None) -> Iterator[WordClip]:
    """Read the rows, all or of one split, one after another, with few in memory.

    Raises CorpusError, naming the shard and the row that cannot be used.
    """
    row = 0
    for batch in _batches(path):
        for index in range(batch.num_rows):
            row += 1
            if split in (None, _text(path, row, batch["split"][index])):
                yield _clip(path, batch, index, row, components)


def _batches(path: Path, names: Sequence[str] | None = None) -> Iterator[Any]:
    """Rows of a shard, `BATCH_ROWS` at a time, valid as Arrow arrays."""
    with _opened(path) as file:
        try:
            for batch in file.iter_batches(BATCH_ROWS, columns=names and list(names)):
                batch.validate(full=True)
                yield batch
        except _arrow_errors() as error:
            raise _unreadable(path, error) from error


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """The shard as a pyarrow ParquetFile, once it is known what it unpacks to.

    Texts come as dictionaries, so that one that is repeated is held once. Raises CorpusError.
    """
    _check_unpacked(path)
    with ExitStack() as stack:
        try:
            raw = stack.enter_context(path.open("rb"))  # a path would have to be UTF-8
            file = pyarrow_parquet().ParquetFile(raw, read_dictionary=list(TEXTS))
        except _arrow_errors() as error:
            raise _unreadable(path, error) from error
        yield stack.enter_context(file)


def _check_unpacked(path: Path) -> None:
    """Refuse what would take far more memory than the file. Raises CorpusError."""
    allowed = "a shard"
    with open_regular(path, FileKind(allowed, FILE_MAX_BYTES, CorpusError)) as file:
        try:
            unpacked, size = unpacked_bytes(file), path.stat().st_size
        except ValueError as error:
            raise _unreadable(path, error) from error
    if unpacked > unpacked_limit(size):
        raise CorpusError.about(
            path,
            found=f"{bytes_text(unpacked)} in {bytes_text(size)}",
            allowed=f"a shard that unpacks to {UNPACKED_TIMES} times its size",
        )


def _arrow_errors() -> tuple[type[Exception], ...]:
    """What pyarrow may raise on a damaged file."""
    import pyarrow as pa

    return pa.ArrowException, OSError, ValueError, KeyError, IndexError, TypeError, MemoryError


def _unreadable(path: Path, error: Exception) -> CorpusError:
    """The error for a file that pyarrow does not read."""
    reason = " ".join(str(error).split())[:120]
    return CorpusError.about(path, found=f"no Parquet file ({reason})", allowed="a shard")


def _plain_types(schema: Any) -> Any:
    """A schema as it is stored: texts that were asked for as dictionaries are texts."""
    import pyarrow as pa

    fields = [
        field.with_type(field.type.value_type) if pa.types.is_dictionary(field.type) else field
        for field in schema
    ]
    return pa.schema(fields)


def _text(path: Path, row: int, value: Any) -> str:
    """A text of a row; raises CorpusError for anything else."""
    try:
        text = value.as_py()
    except ValueError:  # bytes that are no UTF-8
        text = None
    if not isinstance(text, str) or len(text) > TEXT_MAX:
        raise CorpusError.about(
            f"{path}, row {row}", found="cannot be used (not valid text)", allowed="names"
        )
    return text


def _clip(path: Path, batch: Any, index: int, row: int, components: int) -> WordClip:
    """One row of a batch; raises CorpusError where it is not a WordClip."""
    try:
        scalar = batch["parameters"][index].values
        frames = batch["frames"][index].as_py()
        # `flatten` leaves out rows that are null, so a hole shows as a missing frame.
        values = scalar.flatten().to_numpy(zero_copy_only=False).reshape(-1, components)
        if len(values) != frames:
            raise ValueError("frames and parameters differ in number")
        fields = {name: batch[name][index].as_py() for name in (*TEXTS, *NUMBERS)}
        return WordClip(**fields, parameters=values)
    except (*_arrow_errors(), AttributeError) as error:
        raise CorpusError.about(f"{path}, row {row}", found=f"cannot be used ({error})") from error
