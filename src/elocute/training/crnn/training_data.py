"""What the training loop reads: mel columns and parameters of all clips, left on disk.

Sounds are heard once; a later training on the same shards finds them in its folder.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.audio.mel_with_deltas import (
    BANDS,
    CONTEXT,
    HOP,
    MARGIN,
    RATE,
    column_starts,
    mel_columns,
)
from elocute.audio.waveform import Waveform
from elocute.corpus.shards import Shards, WordClip
from elocute.corpus.word_clip import COMPONENTS_MAX
from elocute.errors import AudioError, CorpusError
from elocute.files.arrays import ArrayFile, RowWriter
from elocute.files.atomic import write_folder_atomically
from elocute.files.json_records import finite_number, read_record
from elocute.numerics.resampling import frame_places, read_rows
from elocute.one_line_repr import one_line

Array = NDArray[np.float32]
Progress = Callable[[float], None]
VERSION = 2
STATIC, TARGETS = "static.npy", "targets.npy"
ROWS_MAX_BYTES = 400_000_000
AROUND_S = (CONTEXT + MARGIN + 1) * HOP / RATE  # what windows reach beyond a clip


@dataclass(frozen=True)
class Row:
    """A clip: its columns and frames lie one after another from `column` and `frame` on.

    first is the video frame at which the clip starts in its columns, what is before is context.
    """

    clip: str
    word: str
    speaker: str
    split: str
    column: int
    columns: int
    frame: int
    frames: int
    first: int


@dataclass(frozen=True, eq=False)
class Heard:
    """static (column, 128) float16 log-mel bands, targets (frame, parameter) float32, both left
    on disk; rows say what is where."""

    static: ArrayFile
    targets: ArrayFile
    rows: tuple[Row, ...]
    fps: float
    missing: tuple[tuple[str, str], ...]

    __repr__ = one_line

    def starts(self, row: Row, first: int = 0, frames: int | None = None) -> NDArray[np.int64]:
        """(frame,) first columns of windows, counted from the row's own first column."""
        count = row.frames - first if frames is None else frames
        return column_starts(count, self.fps, row.first + first)

    def columns(self, row: Row) -> NDArray[np.float16]:
        return self.static[row.column : row.column + row.columns]

    def parameters(self, row: Row) -> Array:
        return self.targets[row.frame : row.frame + row.frames]

    def chosen(self, split: str, words: Sequence[str] | None = None) -> list[Row]:
        """Rows of a split, or those of some words only."""
        kept = None if words is None else set(words)
        return [r for r in self.rows if r.split == split and (kept is None or r.word in kept)]


def hear_shards(
    shards: Shards, folder: Path, fps: float = 30.0, progress: Progress | None = None
) -> Heard:
    """Every clip's columns, heard once and kept in `folder`.

    A clip whose sound is missing or broken is left out and named in `missing`. Raises CorpusError
    where none is left.
    """
    key = hashlib.sha256(
        json.dumps(
            [VERSION, fps, shards.components, [entry.sha256 for entry in shards.entries]]
        ).encode()
    ).hexdigest()[:16]
    place = folder / f"heard-{key}"
    if not place.is_dir():
        with write_folder_atomically(place) as draft:
            _hear(shards, draft, fps, progress)
    return _open(place)


def _hear(shards: Shards, folder: Path, fps: float, progress: Progress | None) -> None:
    rows: list[Row] = []
    missing: list[tuple[str, str]] = []
    column = frame = 0
    with (
        RowWriter(folder / STATIC, (BANDS,), "<f2") as static,
        RowWriter(folder / TARGETS, (shards.components,)) as out,
    ):
        for done, clip in enumerate(shards.clips(), 1):
            try:
                values, first, targets = hear_clip(shards, clip, fps)
            except (AudioError, CorpusError) as error:
                missing.append((clip.clip, str(error)))
                continue
            static.add(values)
            out.add(targets)
            rows.append(
                Row(
                    clip.clip,
                    clip.word,
                    clip.speaker,
                    clip.split,
                    column,
                    len(values),
                    frame,
                    len(targets),
                    first,
                )
            )
            column, frame = column + len(values), frame + len(targets)
            if progress:
                progress(done / len(shards))
    if not rows:
        why = f"{missing[0][0]}: {missing[0][1]}" if missing else "no clip"
        raise CorpusError.about(shards.sound_root, found=f"no sound that can be heard; {why}")
    record = {
        "fps": fps,
        "parameters": shards.components,
        "missing": missing,
        "rows": [list(asdict(row).values()) for row in rows],
    }
    (folder / "rows.json").write_text(json.dumps(record), encoding="utf-8")


def _open(folder: Path) -> Heard:
    remedy = "remove that folder"
    record = read_record(
        folder / "rows.json",
        max_bytes=ROWS_MAX_BYTES,
        allowed="features that were kept",
        error=CorpusError,
        remedy=remedy,
    )
    try:
        outputs, fps = record["parameters"], finite_number(record["fps"])
        if type(outputs) is not int or not 0 < outputs <= COMPONENTS_MAX or not fps or fps < 0:
            raise ValueError("no number of parameters or frames per second")
        static = ArrayFile(folder / STATIC, allowed="mel bands", error=CorpusError)
        targets = ArrayFile(folder / TARGETS, allowed="parameters", error=CorpusError)
        for array, width, kind in ((static, BANDS, np.float16), (targets, outputs, np.float32)):
            if array.shape[1:] != (width,) or array.dtype != kind:
                raise ValueError(f"{array.path.name} of shape {array.shape}")
        rows = tuple(_row(row, len(static), len(targets)) for row in record["rows"])
        if not rows:
            raise ValueError("no clip")
        missing = tuple((str(clip), str(why)) for clip, why in record["missing"])
        return Heard(static, targets, rows, fps, missing)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CorpusError.about(
            folder, found=f"features that cannot be read ({str(error)[:120]})", remedy=remedy
        ) from error


def _row(stored: list[Any], columns: int, frames: int) -> Row:
    """Raises ValueError or TypeError for one that reaches beyond what is there."""
    row = Row(*stored)
    places = row.column, row.columns, row.frame, row.frames, row.first
    texts = row.clip, row.word, row.speaker, row.split
    if not all(type(n) is int and n >= 0 for n in places) or not all(
        isinstance(text, str) for text in texts
    ):
        raise ValueError("a row that is none")
    beyond = row.column + row.columns > columns or row.frame + row.frames > frames
    if beyond or not row.frames or row.first > row.columns:
        raise ValueError(f"clip {row.clip[:120]} beyond the columns and frames that are there")
    return row


def hear_clip(
    shards: Shards,
    clip: WordClip,
    fps: float,
    change: Callable[[Waveform], Waveform] | None = None,
) -> tuple[Array, int, Array]:
    """Columns with what is around the clip, the frame it starts at in them, and parameters.

    change  makes another sound of it: adds noise, say
    """
    targets = at_rate(clip.parameters, clip.fps, fps)
    first = math.ceil(AROUND_S * fps)
    sound = shards.sound(clip, first / fps)
    heard = mel_columns(change(sound) if change else sound, fps)
    frames = min(len(targets), len(heard.starts) - first)
    if frames < 1:
        raise CorpusError.about(f"clip {clip.clip}", found="no sound for its frames")
    end = int(heard.starts[first + frames - 1]) + 2 * (CONTEXT + MARGIN) + 1
    # Counted anew from a frame whose column is whole, so that windows fall as they did.
    period = whole_period(fps)
    lead = first // period * period
    begin = int(heard.starts[lead])
    return heard.static[begin:end], first - lead, targets[:frames]


def whole_period(fps: float) -> int:
    """Frames after which frames and columns meet again: 3 at 30 a second."""
    for frames in range(1, 121):
        columns = frames * RATE / HOP / fps
        if abs(columns - round(columns)) < 1e-9:
            return frames
    return 1_000_000  # they never do: everything is kept from the start


def at_rate(values: Array, rate: float, fps: float) -> Array:
    """(frame, parameter) at another frame rate, linear between."""
    if rate == fps:
        return values
    count = max(1, round(len(values) * fps / rate))
    return read_rows(values, frame_places(0, count, rate, fps))


def standard(heard: Heard, rows: Sequence[Row], audible: Array) -> tuple[Array, Array]:
    """(3,) means and deviations of the three channels over some clips, bands that are heard."""
    from elocute.audio.mel_with_deltas import slopes

    sums, squares, count = np.zeros(3), np.zeros(3), 0
    for row in rows[:: max(1, len(rows) // 400)]:
        static = heard.columns(row).astype(np.float32)[:, audible > 0]
        first = slopes(static)
        for channel, values in enumerate((static, first, slopes(first))):
            sums[channel] += float(values.mean(dtype=np.float64))
            squares[channel] += float(np.square(values, dtype=np.float64).mean())
        count += 1
    mean = sums / count
    deviation = np.sqrt(np.maximum(squares / count - mean**2, 1e-12))
    return mean.astype(np.float32), deviation.astype(np.float32)


def batches(rows: Sequence[Row], size: int, order: NDArray[np.intp]) -> Iterator[list[Row]]:
    """Clips in the given order, the last batch smaller."""
    for start in range(0, len(order), size):
        yield [rows[index] for index in order[start : start + size]]
