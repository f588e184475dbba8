"""Columns of features and parameters of all clips of shards, kept on disk.

Sounds are decoded once; a later training on the same shards finds the features in its folder.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.audio.mel_with_deltas import (
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
from elocute.encoders.registry import resolve_encoder
from elocute.errors import AudioError, CorpusError
from elocute.files.array_file import ArrayFile
from elocute.files.array_writing import RowWriter
from elocute.files.atomic import write_folder_atomically
from elocute.files.json_records import finite_number, read_record
from elocute.files.reading import ANY_BYTES, FileKind
from elocute.models.crnn_encoders import MEL
from elocute.models.crnn_network import WINDOW_COLUMNS, HeardColumns, column_features
from elocute.numerics.resampling import frame_places, read_rows
from elocute.one_line_repr import one_line

Progress = Callable[[float], None]
VERSION = 4
STATIC, TARGETS = "static.npy", "targets.npy"
ROWS_MAX_BYTES = 400_000_000
AROUND_S = (CONTEXT + MARGIN + 1) * HOP / RATE  # what windows reach beyond a clip


@dataclass(frozen=True)
class CachedClip:
    """Where the features of a clip are: `columns` from `column` on, `frames` from `frame` on.

    first is the frame of motion at which the clip starts in its columns; what is before is context.
    source is the captured speaker whose motion it carries.
    """

    clip: str
    word: str
    speaker: str
    source: str
    split: str
    column: int
    columns: int
    frame: int
    frames: int
    first: int

    @property
    def carried(self) -> bool:
        """Whether its motion was carried over from somebody else."""
        return self.speaker != self.source


@dataclass(frozen=True, eq=False)
class FeatureCache:
    """static (column, feature) float16 of an encoder and targets (frame, parameter) float32, both
    left on disk; clips say what is where, missing which clips were left out and why."""

    static: ArrayFile
    targets: ArrayFile
    clips: tuple[CachedClip, ...]
    fps: float
    missing: tuple[tuple[str, str], ...]
    encoder: str = MEL

    __repr__ = one_line

    def starts(
        self, clip: CachedClip, first: int = 0, frames: int | None = None
    ) -> NDArray[np.int64]:
        """(frame,) first columns of windows, counted from the clip's own first column."""
        count = clip.frames - first if frames is None else frames
        return column_starts(count, self.fps, clip.first + first)

    def columns(self, clip: CachedClip) -> NDArray[np.float16]:
        return self.static[clip.column : clip.column + clip.columns]

    def parameters(self, clip: CachedClip) -> Float32Array:
        return self.targets[clip.frame : clip.frame + clip.frames]

    def select(self, split: str, words: Sequence[str] | None = None) -> list[CachedClip]:
        """Clips of a split, or those of some words only."""
        kept = None if words is None else set(words)
        return [c for c in self.clips if c.split == split and (kept is None or c.word in kept)]


def cache_features(
    shards: Shards,
    folder: Path,
    fps: float = 30.0,
    progress: Progress | None = None,
    encoder: str = MEL,
) -> FeatureCache:
    """Features of all clips, computed once and kept in a folder of `folder` named by their sources.

    fps: of the model. progress: called with the share of the clips that is done. encoder:
    `mel-deltas` or `trunk`. A clip whose sound is missing or broken is left out and named in
    `missing`; CorpusError where no clip is left, or kept features cannot be read.
    """
    key = hashlib.sha256(
        json.dumps(
            [VERSION, encoder, fps, shards.components, [entry.sha256 for entry in shards.entries]]
        ).encode()
    ).hexdigest()[:16]
    place = folder / f"heard-{key}"
    if not place.is_dir():
        with write_folder_atomically(place) as draft:
            _compute(shards, draft, fps, progress, encoder)
    return open_feature_cache(place)


def _compute(
    shards: Shards, folder: Path, fps: float, progress: Progress | None, encoder: str
) -> None:
    rows: list[CachedClip] = []
    missing: list[tuple[str, str]] = []
    column = frame = 0
    with (
        RowWriter(folder / STATIC, (column_features(encoder),), "<f2") as static,
        RowWriter(folder / TARGETS, (shards.components,)) as out,
    ):
        for done, clip in enumerate(shards.clips(), 1):
            try:
                values, first, targets = clip_features(shards, clip, fps, encoder=encoder)
            except (AudioError, CorpusError) as error:
                missing.append((clip.clip, str(error)))
                continue
            static.add(values)
            out.add(targets)
            rows.append(
                CachedClip(
                    clip=clip.clip,
                    word=clip.word,
                    speaker=clip.speaker,
                    source=clip.source,
                    split=clip.split,
                    column=column,
                    columns=len(values),
                    frame=frame,
                    frames=len(targets),
                    first=first,
                )
            )
            column, frame = column + len(values), frame + len(targets)
            if progress:
                progress(done / len(shards))
    if not rows:
        why = f"{missing[0][0]}: {missing[0][1]}" if missing else "no clip"
        raise CorpusError.about(shards.sound_root, found=f"no sound that can be read; {why}")
    record = {
        "fps": fps,
        "encoder": encoder,
        "parameters": shards.components,
        "missing": missing,
        "rows": [list(asdict(row).values()) for row in rows],
    }
    (folder / "rows.json").write_text(json.dumps(record), encoding="utf-8")


def open_feature_cache(folder: Path) -> FeatureCache:
    """Features that `cache_features` kept. Raises CorpusError where they are broken."""
    remedy = "remove that folder"
    record = read_record(
        folder / "rows.json",
        FileKind("features that were kept", ROWS_MAX_BYTES, CorpusError, remedy),
    )
    try:
        outputs, fps = record["parameters"], finite_number(record["fps"])
        if type(outputs) is not int or not 0 < outputs <= COMPONENTS_MAX or not fps or fps < 0:
            raise ValueError("no number of parameters or frames per second")
        encoder = str(record["encoder"])
        static = ArrayFile(folder / STATIC, FileKind("columns of features", ANY_BYTES, CorpusError))
        targets = ArrayFile(folder / TARGETS, FileKind("parameters", ANY_BYTES, CorpusError))
        for array, width, kind in (
            (static, column_features(encoder), np.float16),
            (targets, outputs, np.float32),
        ):
            if array.shape[1:] != (width,) or array.dtype != kind:
                raise ValueError(f"{array.path.name} of shape {array.shape}")
        clips = tuple(_stored_clip(each, len(static), len(targets)) for each in record["rows"])
        if not clips:
            raise ValueError("no clip")
        missing = tuple((str(clip), str(why)) for clip, why in record["missing"])
        return FeatureCache(static, targets, clips, fps, missing, encoder)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CorpusError.about(
            folder, found=f"features that cannot be read ({str(error)[:120]})", remedy=remedy
        ) from error


def _stored_clip(stored: list[Any], columns: int, frames: int) -> CachedClip:
    """Raises ValueError or TypeError for one that reaches beyond what is there."""
    clip = CachedClip(*stored)
    places = clip.column, clip.columns, clip.frame, clip.frames, clip.first
    texts = clip.clip, clip.word, clip.speaker, clip.source, clip.split
    if not all(type(n) is int and n >= 0 for n in places) or not all(
        isinstance(text, str) for text in texts
    ):
        raise ValueError("a clip without its places")
    beyond = clip.column + clip.columns > columns or clip.frame + clip.frames > frames
    if beyond or not clip.frames or clip.first > clip.columns:
        raise ValueError(f"clip {clip.clip[:120]} beyond the columns and frames that are there")
    return clip


def clip_features(
    shards: Shards,
    clip: WordClip,
    fps: float,
    change: Callable[[Waveform], Waveform] | None = None,
    encoder: str = MEL,
) -> tuple[Float32Array, int, Float32Array]:
    """Columns (column, feature) of a clip and the sound around it, its first frame in them,
    targets.

    The first counts frames of the columns; targets are parameters (frame, parameter) at `fps`.
    change: what is done to the sound first, adding noise for example. encoder: as for
    `cache_features`. Raises CorpusError for a clip without sound for its frames.
    """
    targets = at_rate(clip.parameters, clip.fps, fps)
    first = math.ceil(AROUND_S * fps)
    sound = shards.sound(clip, first / fps)
    sound = change(sound) if change else sound
    static, starts = columns_of(sound, fps, encoder)
    frames = min(len(targets), len(starts) - first)
    if frames < 1:
        raise CorpusError.about(f"clip {clip.clip}", found="no sound for its frames")
    end = int(starts[first + frames - 1]) + 2 * (CONTEXT + MARGIN) + 1
    # Counted anew from a frame whose column is whole, so that windows fall as they did.
    period = whole_period(fps)
    lead = first // period * period
    begin = int(starts[lead])
    return static[begin:end], first - lead, targets[:frames]


def columns_of(sound: Waveform, fps: float, encoder: str) -> tuple[Float32Array, NDArray[np.int64]]:
    """(column, feature) of a sound, and (frame,) where the windows of frames begin in them."""
    if encoder == MEL:
        mel = mel_columns(sound, fps)
        return mel.static, mel.starts
    starts = column_starts(max(1, round(sound.duration_s * fps)), fps)
    end = int(starts[-1]) + WINDOW_COLUMNS
    heard = HeardColumns()
    heard.push(resolve_encoder(encoder)(sound).values)
    heard.finish(end)
    return heard.of(0, end), starts


def whole_period(fps: float) -> int:
    """Frames after which frames and columns meet again: 3 at 30 a second."""
    for frames in range(1, 121):
        columns = frames * RATE / HOP / fps
        if abs(columns - round(columns)) < 1e-9:
            return frames
    return 1_000_000  # they never do: everything is kept from the start


def at_rate(values: Float32Array, rate: float, fps: float) -> Float32Array:
    """(frame, parameter) at another frame rate, linear between."""
    if rate == fps:
        return values
    count = max(1, round(len(values) * fps / rate))
    return read_rows(values, frame_places(0, count, rate, fps))
